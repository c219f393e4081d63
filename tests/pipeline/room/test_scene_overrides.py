"""Rooms with another panel or another number of scatterers than their scenes say."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.room.scene_overrides import ABOVE, APART, OFF_WALLS, change_room
from rislam_rt.pipeline.run import check_run, prepare_setup
from rislam_rt.pipeline.specification.pipeline_spec import RoomSection
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[3]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"


def change(scene, seed=0, **settings):
    return change_room(scene, RoomSection(**settings), rng=np.random.default_rng(seed))


def test_nothing_asked_for_changes_nothing(room):
    changed = change(room)
    assert changed.scatterers == room.scatterers
    assert changed.ris is room.ris


def test_a_larger_panel_keeps_place_and_spacing(room):
    panel = change(room, panel_rows=8, panel_cols=10, panel_levels=2).ris
    assert (panel.spec.rows, panel.spec.cols, panel.spec.levels) == (8, 10, 2)
    np.testing.assert_array_equal(panel.center, room.ris.center)
    np.testing.assert_array_equal(panel.spec.spacing, room.ris.spec.spacing)
    np.testing.assert_allclose(panel.spec.offsets().mean(axis=(0, 1)), 0.0, atol=1e-12)


def test_added_scatterers_can_be_told_apart_and_heard(room):
    changed = change(room, scatterers=5)
    assert changed.scatterers[0] is room.scatterers[0]
    assert len({s.name for s in changed.scatterers}) == 5
    added = np.array([s.position for s in changed.scatterers[1:]])
    assert distance_to_triangles(added, build_walls(room).triangles).min() >= OFF_WALLS
    gaps = np.linalg.norm(changed.landmark_positions[:, None] - changed.landmark_positions, axis=-1)
    assert gaps[~np.eye(len(gaps), dtype=bool)].min() >= APART
    assert (added[:, 2] >= room.agent.position[:, 2].max() + ABOVE).all()
    assert (change(room, seed=1, scatterers=5).scatterers[1].position != added[0]).any()
    assert change(room, scatterers=0).scatterers == ()


def test_what_a_room_cannot_be_is_refused(room):
    with pytest.raises(ConfigError, match=r"scatterers: 100 received; .* has room for"):
        change(room, scatterers=100)
    box = load_scene(ROOT / "scenes" / "empty_box")
    with pytest.raises(ConfigError, match="no panel to change"):
        change(box, panel_rows=4)
    with pytest.raises(ConfigError, match="divisor of the panel's 6"):
        check_run(room, load_spec(PIPELINE, ["room.panel_levels=6", "control.levels=4"]))


def test_the_run_goes_on_in_the_changed_room(room):
    spec = load_spec(
        PIPELINE, ["channel=image_source", "cycles=3", "depth=0", "room.panel_rows=4", "room.scatterers=3"]
    )
    setup = prepare_setup(room, spec, rng=np.random.default_rng(1))
    assert setup.paths.landmarks == setup.scene.landmarks
    assert len(setup.scene.landmarks) == 4
    assert setup.paths.ris.tx.shape[2:] == (4, 6)
