"""A run in a room of two panels: found and told apart, stored and read back, slices and faults alike."""

from dataclasses import replace

import numpy as np
import pytest

import rislam_rt
from rislam_rt.model import RadioConfig
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.design_at_position import design_at, design_table
from rislam_rt.pipeline.long.slices import join_schemes, subsampled_scheme
from rislam_rt.pipeline.recordings.inputs import dataset_to_inputs, inputs_to_dataset
from rislam_rt.pipeline.run_datasets import dataset_to_paths, dataset_to_scheme, paths_to_dataset, scheme_to_dataset
from rislam_rt.pipeline.scores.summary import landmark_track, summarise_scheme
from rislam_rt.report.code_pictures import draw_run_codes
from rislam_rt.report.conclusions import panel_found_at
from rislam_rt.report.map_from_above import draw_above
from rislam_rt.shipped import find_pipeline, find_room

SET = [
    "channel=image_source",
    "depth=1",
    "design.method=coordinate",
    "receiver.alternation=true",
    "receiver.estimator=bound",
    "slam.filter=window",
    "slam.use_vt=true",
]


def run(cycles: int, *keys: str, **about):
    scene = replace(rislam_rt.load_scene(find_room("two_panels")), **about)
    spec = load_spec(find_pipeline("trace_then_slam"), [*SET, f"cycles={cycles}", *keys])
    return rislam_rt.run_slam(scene, spec, rng=np.random.default_rng(7))


@pytest.fixture(scope="module")
def result():
    """Long enough for both panels to be found, once."""
    return run(30, 'schemes=["optimized"]')


def test_both_panels_are_found_and_told_apart(result):
    scheme = result.schemes["optimized"]
    scores = summarise_scheme(result, scheme)["landmarks"]
    track = landmark_track(result.scene, scheme)
    for panel, name in enumerate(("above", "beside")):
        assert panel_found_at(result, scheme, panel) is not None
        row = scheme.map.panel_row(panel)
        off, spread = scheme.map.position[row] - result.scene.panels[panel].center, scheme.map.covariance[row]
        assert off @ np.linalg.solve(spread, off) < 16.3  # chi^2, 3 dof: 0.999
        assert np.sqrt(np.trace(spread)) < 0.2  # it claims 0.02 m above, 0.18 m beside
        assert scores[name]["cycles_identified"] > 5
        assert 0.0 <= scores[name]["audible_from_s"] < scores[name]["identified_from_s"] < 2.5
        named = np.argwhere(scheme.named(panel))
        assert (track.column[named[:, 0], 1 + panel] == named[:, 1]).all()  # never another landmark
    assert panel_found_at(result, scheme, 2) is None
    assert scheme.map.panel_row(0) != scheme.map.panel_row(1) >= 0
    assert "2 panels known" in repr(scheme.map)
    assert "cycles_identified" not in scores["sphere"]
    assert scheme.applied.shape == (30, 1, 100)


def test_which_panel_is_kept_in_the_files(result):
    scheme = result.schemes["optimized"]
    data = scheme_to_dataset(scheme)
    again = dataset_to_scheme(data)
    np.testing.assert_array_equal(again.panel, scheme.panel)
    np.testing.assert_array_equal(again.map.panel, scheme.map.panel)
    paths = dataset_to_paths(paths_to_dataset(result.paths, result.scene.agent))
    np.testing.assert_array_equal(paths.panel, result.paths.panel)
    assert set(paths.panel.tolist()) == {-1, 0, 1}
    given = dataset_to_inputs(inputs_to_dataset(scheme.given.inputs))
    assert given.panel.num_elements == 100
    for one, other in zip(given.measurements, scheme.given.inputs.measurements, strict=True):
        np.testing.assert_array_equal(one.panel, other.panel)
    few = subsampled_scheme(scheme, np.array([3, 29]))
    np.testing.assert_array_equal(few.panel, scheme.panel[[3, 29]])
    twice = join_schemes([scheme, scheme], [result.paths, result.paths])
    np.testing.assert_array_equal(twice.panel, np.concatenate([scheme.panel, scheme.panel]))


def test_a_map_that_is_still_empty_has_no_panels(result):
    begun = run(1, 'schemes=["optimized"]').schemes["optimized"]
    assert begun.panel is None
    mixed = join_schemes([begun, result.schemes["optimized"]], [result.paths, result.paths])
    assert mixed.panel.shape == (31, len(mixed.ident))


def test_faults_of_every_element_reach_the_air():
    perfect, dead = (run(2, 'schemes=["random"]', *more) for more in ((), ("panel.dead=1.0",)))
    over = perfect.paths.panel >= 0
    assert np.abs(perfect.schemes["random"].gain[:, over]).max() > 0.0
    assert not dead.schemes["random"].gain[:, over].any()


def test_the_picture_of_the_room_says_which_is_held_for_which(result):
    texts = [text.get_text() for text in draw_above(result).axes[0].texts]
    assert {"held for above", "held for beside"} <= set(texts)


def test_pictures_of_both_codes_are_drawn(result):
    figure = draw_run_codes(result, 2)
    image = figure.axes[0].images[0].get_array()
    assert image.shape == (8, 15)  # 6 x 6 and 8 x 8 elements, a gap between them
    assert np.isfinite(np.ma.filled(image, np.nan)).sum() == 100


def test_a_design_at_a_point_says_the_gain_of_each_panel():
    room = rislam_rt.load_scene(find_room("two_panels"))
    point = np.array([3.0, 2.0, 0.6])
    found = design_at(
        room, RadioConfig(), point, channel="image_source", depth=0, rng=np.random.default_rng(1)
    )  # fmt: skip
    assert set(found.panels["exact"]) == {"above", "beside"}
    assert found.panels["exact"]["above"] == pytest.approx(found.designs["exact"].gain_db, abs=1e-9)
    for panel in ("above", "beside"):
        levels = [gains[panel] for name, gains in found.panels.items() if name != "continuous"]
        assert found.panels["exact"][panel] == max(levels)
    assert "panel_gain_db" in design_table(found)["methods"]["exact"]
    alone = design_at(
        replace(room, ris=room.panels[1]), RadioConfig(), point, channel="image_source", depth=0,
        rng=np.random.default_rng(1),
    )  # fmt: skip
    assert alone.designs["exact"].gain_db == pytest.approx(found.panels["exact"]["beside"], abs=1e-9)
    assert "panel_gain_db" not in design_table(alone)["methods"]["exact"]
