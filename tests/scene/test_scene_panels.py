"""Several panels in a scene file: `[[ris]]` beside `[ris]`, and what is refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.model import RisPanel, Scene, join_panels
from rislam_rt.scene import load_scene
from rislam_rt.scene.check.panel import panel_errors
from rislam_rt.scene.check.triangle_array import build_triangle_array
from rislam_rt.shipped import find_room

Damage = Callable[[str, str], Path]


def second(**keys: object) -> str:
    """A second panel on the paper's ceiling, as TOML."""
    panel = {"name": '"second"', "center": [1.0, 1.0, 3.0], "normal": [0.0, 0.0, -1.0], "up": [0.0, 1.0, 0.0]}
    panel |= {"rows": 3, "cols": 4, "spacing_m": [0.015, 0.015], "levels": 4, "host": '"ceiling"'} | keys
    return "[[ris]]\n" + "".join(f"{key} = {value}\n" for key, value in panel.items())


def test_both_panels_are_read(damaged: Damage) -> None:
    scene = load_scene(damaged("[ris]", second() + "[[ris]]"))
    assert [panel.name for panel in scene.panels] == ["second", "ris"]
    assert scene.landmarks == ("sphere", "second", "ris")
    assert [panel.spec.num_elements for panel in scene.panels] == [12, 36]
    assert "panel of 3 x 4" in repr(scene)
    assert "panel of 6 x 6" in repr(scene)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"name": '"ris"'}, "ris.name: ris, ris received; give every panel a name of its own"),
        ({"levels": 2}, "ris.levels: [2, 4] received; give all panels the same number"),
        ({"rows": 0}, "ris[0].rows: 0 received"),
        ({"up": [0.0, 1.0, 1.0]}, "ris[0].up: 135.000 degrees from ris.normal"),
        ({"center": [1.0, 1.0, 2.9]}, "ris[0].center: [1.0, 1.0, 2.9] is 100 mm off 'ceiling'"),
        ({"center": [3.02, 3.0, 3.0]}, "ris[1].center: 'ris' covers a part of 'second'"),
    ],
)
def test_a_bad_second_panel_is_named(damaged: Damage, keys: dict[str, object], says: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(damaged("[ris]", second(**keys) + "[[ris]]"))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "spacing_m = [0.015, 0.015]", "spacing_m = [15.0, 15.0]",
            "ris.spacing_m: the panel of 90 m x 90 m is larger than the room, 9 m across; in centimetres it would be "
            "[0.9, 0.9] m, in millimetres [0.09, 0.09] m, in inches [2.286, 2.286] m; give metres: multiply by 0.01",
        ),
        (
            "rows = 6", "rows = 1000",
            "ris.rows: the panel of 0.09 m x 15 m is larger than the room, 9 m across; take fewer elements, or put",
        ),
    ],
)  # fmt: skip
def test_a_panel_larger_than_the_room_is_an_error(damaged: Damage, old: str, new: str, says: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(damaged(old, new))
    assert says in str(caught.value)


@pytest.mark.parametrize("before", [0.0, 0.01, 0.05])
def test_a_panel_may_hang_a_little_before_its_host(damaged: Damage, before: float) -> None:
    """And it stays where the file says."""
    scene = load_scene(damaged("center = [3.0, 3.0, 3.0]", f"center = [3.0, 3.0, {3.0 - before}]"))
    np.testing.assert_array_equal(scene.panels[0].center, [3.0, 3.0, 3.0 - before])


def test_panels_overlap_where_they_share_a_piece_of_plane() -> None:
    scene = load_scene(find_room("two_panels"))
    one = scene.panels[0]
    width, height = one.spec.cols * one.spec.spacing[0], one.spec.rows * one.spec.spacing[1]

    def overlap(shift: np.ndarray, turn: float = 0.0) -> bool:
        up = np.cos(turn) * one.spec.up + np.sin(turn) * one.spec.right
        spec = replace(one.spec, up=up)
        both: Scene = replace(scene, ris=join_panels((one, RisPanel(spec, one.center + shift, one.host, "other"))))
        return any("covers a part" in finding.message for finding in panel_errors(build_triangle_array(both, "file")))

    assert overlap(np.zeros(3))
    assert overlap((width - 0.01) * one.spec.right)
    assert not overlap((width + 0.001) * one.spec.right)
    assert not overlap((height + 0.001) * one.spec.up)
    corner = 0.5 * (one.spec.right + one.spec.up) * (width + 0.001)
    assert overlap(corner)
    # turned by 45 degrees its corner reaches (1 + sqrt 2) / 2 of a width to the side
    assert overlap(1.18 * width * one.spec.right, np.pi / 4.0)
    assert not overlap(1.22 * width * one.spec.right, np.pi / 4.0)
