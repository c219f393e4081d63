"""The fit's gradient against finite differences, its repeatability, the scores by hand, the pipeline file."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind
from rislam_rt.scene.random_rooms.box_rooms import random_room
from rislam_rt.slam.classify import FEATURES, Network, blend, classify
from rislam_rt.studies import ClassifierSpec, load_any
from rislam_rt.studies.classifier.score import (
    by_value,
    mean_over_rooms,
    mistakes,
    odds_over_life,
    panel_dropped,
    right_by_class,
    score,
)
from rislam_rt.studies.classifier.train import balance, loss_and_slope, train_network
from rislam_rt.studies.classifier.training_examples import CLUTTER, OVER_RX, OVER_TX, Examples

FILE = Path(__file__).parents[3] / "pipelines" / "train_classifier.toml"


def examples_of(kind, **fields):
    """Examples of these path classes, all else alike, of one walk and track."""
    count = len(kind)
    none = np.zeros(count, dtype=int)
    plain = {
        "features": np.zeros((count, len(FEATURES))), "kind": np.array(kind), "legs": none, "age": none + 1,
        "ratio": np.ones(count), "walk": none, "policy": none, "track": none, "near": none.astype(bool),
    }  # fmt: skip
    return Examples(**{**plain, **{name: np.array(value) for name, value in fields.items()}})


SHAPES = [(3, 4), (4,), (4, 4), (4,), (4, 1), (1,)]


def test_gradient_is_the_slope_of_the_loss():
    """Central differences of step 1e-6: second order 1e-12 relative, rounding 1e-10 absolute."""
    rng = np.random.default_rng(2)
    flat = 0.5 * rng.standard_normal(sum(int(np.prod(shape)) for shape in SHAPES))
    inputs, target = rng.standard_normal((20, 3)), rng.integers(2, size=20).astype(float)
    share = rng.dirichlet(np.ones(20))

    def loss(x):
        return loss_and_slope(x, SHAPES, inputs, target, share, 0.1)[0]

    slope = loss_and_slope(flat, SHAPES, inputs, target, share, 0.1)[1]
    steps = 1e-6 * np.eye(len(flat))
    numeric = [(loss(flat + step) - loss(flat - step)) / 2e-6 for step in steps]
    assert slope == pytest.approx(numeric, abs=1e-8)


def test_a_fit_learns_what_no_plane_separates_and_repeats_itself():
    rng = np.random.default_rng(4)
    features = rng.uniform(-1.0, 1.0, (400, len(FEATURES)))
    keep = features[:, 0] * features[:, 1] > 0.0
    fits = [train_network(features, keep, np.ones(400), 8, 1e-4, 200, rng=np.random.default_rng(1)) for _ in range(2)]
    assert np.mean((classify(features, fits[0]) > 0.5) == keep) > 0.97
    assert all((a == b).all() for a, b in zip(fits[0].weight, fits[1].weight, strict=True))


def test_scores_of_a_small_table():
    """4 kept rightly, 1 wrongly, 2 missed: F1 = 8 / 11; clutter counts apart."""
    kind = np.array([PathKind.PS] * 6 + [PathKind.VT] * 3 + [CLUTTER] * 2)
    kept = np.array([1, 1, 1, 1, 0, 0, 1, 0, 0, 1, 0], dtype=bool)
    count, examples = len(kind), examples_of(kind)
    found = score(examples, lambda _: kept, 0.95, rng=np.random.default_rng(0))
    assert found.f1 == pytest.approx(8.0 / 11.0)
    assert (found.precision, found.recall) == pytest.approx((0.8, 4.0 / 6.0))
    assert (found.removed, found.clutter_kept) == pytest.approx((2.0 / 3.0, 0.5))
    assert found.low == found.f1 == found.high  # a single walk
    assert mistakes(examples, lambda _: kept) == {"VT": (1, 3), "PS": (2, 6)}
    # of the keep the first two have age 2: one class of age alone
    age = np.where(np.arange(count) < 2, 2, 1)
    assert by_value(examples, lambda _: kept, age, (1, 2, 3))["2"] == (1.0, 2)


def test_classes_are_told_apart_by_their_legs_and_the_panel_by_its_codes():
    """VS on either leg and on both; the direct panel path under two policies, a third of it dropped under the last."""
    kind = [PathKind.LOS, *3 * [PathKind.VS], *4 * [PathKind.RIS], CLUTTER]
    legs = [0, OVER_RX, OVER_TX, OVER_RX + OVER_TX, 0, 0, 0, 0, 0]
    examples = examples_of(kind, legs=legs, policy=[0, 0, 0, 0, 0, 3, 3, 3, 3])
    kept = np.array([0, 1, 0, 1, 1, 1, 1, 0, 1], dtype=bool)
    assert mistakes(examples, lambda _: kept) == {
        "LOS": (0, 1), "VS": (0, 1), "VS reciprocal": (1, 1), "VS both legs": (0, 1), "RIS": (1, 4),
    }  # fmt: skip
    dropped = panel_dropped(examples, lambda _: kept)
    assert dropped == {"random": (0, 1), "held": (0, 0), "aimed": (0, 0), "exact": (1, 3)}
    assert right_by_class(examples, lambda _: kept) == pytest.approx((1.0 + 2.0 / 3.0 + 3.0 / 4.0) / 3.0)


def test_rare_classes_count_as_common_ones():
    """90 VS and one panel path weigh the same, and together as much as all wall returns; a long walk counts less."""
    kind = [*90 * [PathKind.VS], PathKind.RIS, *4 * [PathKind.VT], PathKind.VT]
    weight = balance(examples_of(kind, walk=[*95 * [0], 1]))
    assert weight[:90].sum() == pytest.approx(0.25)
    assert weight[90] == pytest.approx(0.25)
    assert weight[91:].sum() == pytest.approx(0.5)
    assert weight[95] / weight[91] == pytest.approx(np.sqrt(95.0))


def test_mean_over_rooms_gives_each_room_the_same_weight():
    """Two rooms, of F1 1 and 0, the first of a hundred times as many components; a single walk each: no spread."""
    rooms = []
    for count, kept in ((200, 1.0), (2, 0.0)):
        rooms.append(examples_of(count * [PathKind.PS], features=np.full((count, len(FEATURES)), kept)))
    mean = mean_over_rooms(rooms, lambda e: e.features[:, 0] > 0.5, 0.95, rng=np.random.default_rng(0))
    assert mean.tolist() == [0.5, 0.5, 0.5]


def test_odds_over_a_tracks_life_are_the_clipped_mean_at_first():
    """Two tracks of one walk, looks of each in the order of time; the same label in another walk starts anew."""
    network = Network(
        np.zeros(len(FEATURES)), np.ones(len(FEATURES)),
        (np.eye(len(FEATURES))[:, :1], np.ones((1, 1)), np.ones((1, 1))), (np.zeros(1), np.zeros(1), np.zeros(1)),
    )  # fmt: skip
    value = np.array([0.5, -3.0, 0.1, 0.2, -0.7])
    features = np.zeros((5, len(FEATURES)))
    features[:, 0] = value
    fresh = np.tanh(np.tanh(value))
    track, walk = np.array([1, 2, 1, 1, 1]), np.array([0, 0, 0, 0, 1])
    examples = examples_of(5 * [PathKind.PS], features=features, walk=walk, track=track)
    odds = odds_over_life(examples, network)
    wanted = [fresh[0], fresh[1], fresh[[0, 2]].mean(), fresh[[0, 2, 3]].mean(), fresh[4]]
    assert odds == pytest.approx(wanted, rel=1e-12)
    # the same walk under other codes is another one
    other = odds_over_life(examples._replace(policy=np.array([0, 0, 1, 0, 0])), network)
    assert other == pytest.approx([fresh[0], fresh[1], fresh[2], fresh[[0, 3]].mean(), fresh[4]], rel=1e-12)
    assert blend(np.zeros(1), np.zeros(1, dtype=int), np.array([1e9])) == pytest.approx([8.0])
    # many looks later the latest still counts by the least share
    assert blend(np.ones(1), np.array([1000]), np.zeros(1)) == pytest.approx([0.7])


@pytest.mark.parametrize("number", range(6))
def test_random_rooms_are_closed_and_hold_what_they_should(number):
    """The centre of the room sees only faces: rays in all directions meet one. The panel lies in the ceiling's plane
    to rounding; scatterers lie inside the bounds; the same seed gives the same room."""
    scene, again = (random_room("room", rng=np.random.default_rng(number)) for _ in range(2))
    assert (scene.bounds == again.bounds).all()
    assert [s.rcs for s in scene.scatterers] == [s.rcs for s in again.scatterers]
    corners = np.concatenate([one.triangles for one in scene.reflectors])
    center = scene.bounds.mean(axis=0)
    rays = np.random.default_rng(1).standard_normal((200, 3))
    base, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    system = np.stack(np.broadcast_arrays(edges[None, :, 0], edges[None, :, 1], -rays[:, None]), axis=-1)
    u, v, reach = np.moveaxis(np.linalg.solve(system, (center - base)[None, ..., None])[..., 0], -1, 0)
    meets = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (reach > 0.0)
    assert meets.any(axis=1).all()
    spheres = np.array([one.position for one in scene.scatterers])
    assert ((spheres > scene.bounds[0]) & (spheres < scene.bounds[1])).all()
    if scene.ris is not None:
        host = next(one for one in scene.reflectors if one.name == scene.ris.host).vertices
        assert (host - scene.ris.center) @ scene.ris.spec.normal == pytest.approx(0.0, abs=1e-12)
        assert (center - scene.ris.center) @ scene.ris.spec.normal > 0.0


def test_the_committed_pipeline_is_read():
    spec = load_any(FILE)
    assert isinstance(spec, ClassifierSpec)
    assert ClassifierSpec.model_validate(spec.model_dump(mode="json")) == spec
    assert all((FILE.parent / room.scene).is_dir() for room in spec.rooms)
    with pytest.raises(ConfigError, match="snr_high_db"):
        load_any(FILE, ["snr_low_db=40.0"])
