"""The fit's gradient against finite differences, its repeatability, the scores by hand, the pipeline file."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind
from rislam_rt.pipeline.studies import ClassifierSpec, load_any
from rislam_rt.pipeline.studies.classifier.gather import CLUTTER, Examples
from rislam_rt.pipeline.studies.classifier.score import mistakes, score
from rislam_rt.pipeline.studies.classifier.train import loss_and_slope, train_network
from rislam_rt.slam.classify import FEATURES, classify

FILE = Path(__file__).parents[3] / "pipelines" / "train_classifier.toml"
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
    count = len(kind)
    examples = Examples(
        np.zeros((count, len(FEATURES))), kind, np.ones(count, dtype=int), np.ones(count), np.zeros(count, dtype=int)
    )
    found = score(examples, lambda _: kept, 0.95, rng=np.random.default_rng(0))
    assert found.f1 == pytest.approx(8.0 / 11.0)
    assert (found.precision, found.recall) == pytest.approx((0.8, 4.0 / 6.0))
    assert (found.removed, found.clutter_kept) == pytest.approx((2.0 / 3.0, 0.5))
    assert found.low == found.f1 == found.high  # a single walk
    assert mistakes(examples, lambda _: kept) == {"VT": (1, 3), "PS": (2, 6)}


def test_the_committed_pipeline_is_read_and_wants_both_uses():
    spec = load_any(FILE)
    assert isinstance(spec, ClassifierSpec)
    assert ClassifierSpec.model_validate(spec.model_dump(mode="json")) == spec
    assert all((FILE.parent / room.scene).is_dir() for room in spec.rooms)
    with pytest.raises(ConfigError, match="snr_high_db"):
        load_any(FILE, ["snr_low_db=40.0"])
