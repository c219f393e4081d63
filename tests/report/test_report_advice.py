"""The adviser's word as people read it, and the map of a panel."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from rislam_rt.adviser.advice import Advice
from rislam_rt.adviser.coverage import Coverage
from rislam_rt.adviser.link_budget import NOTHING_DB, LandmarkLink
from rislam_rt.adviser.tracing_cost import TraceCost
from rislam_rt.report import advice
from rislam_rt.report.advice import draw_coverage, print_advice
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]


def test_a_margin_in_brackets_is_not_heard_and_the_commonest_reason_is_given(
    capsys: pytest.CaptureFixture[str],
) -> None:
    margins, chances = np.array([3.2, -4.0, NOTHING_DB]), np.array([0.9, 0.0, 0.0])
    reasons = ("", "too weak", "shaded by 'crate'")
    links = [
        LandmarkLink("lamp", "", margins, chances, reasons),
        LandmarkLink("ris", "aimed", margins + 9, np.ones(3), ("", "", "")),
    ]
    costs = [TraceCost(1, 6, 33, 31, 0.2), TraceCost(2, 6, 10**9, None, None)]
    print_advice(Advice(links, ["lamp: heard at times: [too] weak"], costs, 10.0))
    text = capsys.readouterr().out
    lamp = next(line for line in text.splitlines() if "lamp" in line and "any" in line)
    assert "+3.2" in lamp
    assert "(-4.0)" in lamp
    assert "none" in lamp
    assert "30%" in lamp
    assert "too weak" in lamp
    assert "in brackets: not heard there" in text
    assert "lamp: heard at times: [too] weak" in text
    assert "to trace 6 walls: 1 bounce: 33 wall sequences" in text
    assert "up to 10^9 wall sequences" in text


@pytest.mark.parametrize(
    ("code", "reasons", "says"),
    [
        (
            "",
            ("too weak", "not to be told from VT floor", "too weak"),
            "too weak; middle: not to be told from VT floor",
        ),
        ("", ("beyond the receiver's delays",) * 3, "beyond the receiver's delays"),
        ("", ("", "", ""), "middle: weakened by paths that come in with it"),
        ("aimed", ("too weak", "", "too weak"), "too weak; middle: weakened by paths that come in with it"),
        ("swept", ("", "", ""), "middle: most beams miss it"),
        ("random", ("", "", ""), "middle: most codes miss it"),
    ],
)
def test_a_loud_landmark_in_brackets_says_why_in_its_row(
    code: str,
    reasons: tuple[str, str, str],
    says: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    link = LandmarkLink("lamp", code, np.array([-3.0, 14.7, -4.0]), np.array([0.0, 0.2, 0.0]), reasons)
    print_advice(Advice([link], [], [TraceCost(1, 6, 33, 31, 0.2)], 10.0))
    text = capsys.readouterr().out
    row = next(line for line in text.splitlines() if "(+14.7)" in line)
    assert row.split("│")[-2].strip() == says
    assert "below 0 dB it is too weak, above it is for the reason in the last column" in text


def test_long_names_of_landmarks_are_told_apart(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cut to the column's width, both posts of a frame had one name."""
    monkeypatch.setenv("COLUMNS", "80")
    margins, reasons = (
        np.array([-3.0, 14.7, -4.0]),
        ("too weak", "not to be told from VT traffic_mirror_back", "too weak"),
    )
    links = [LandmarkLink(f"frame_post_{side}", "any", margins, np.zeros(3), reasons) for side in ("left", "right")]
    print_advice(Advice(links, [], [TraceCost(1, 6, 33, 31, 0.2)], 10.0))
    names = [line.split("│")[1].strip() for line in capsys.readouterr().out.splitlines() if line.count("│") > 2]
    assert "".join(names).count("frame_post_left") == "".join(names).count("frame_post_right") == 1


def test_a_place_in_brackets_of_a_landmark_that_is_heard_says_why_too(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    late = ("", "", "beyond the receiver's delays")
    link = LandmarkLink("ris", "aimed", np.array([26.0, 16.0, 13.2]), np.array([1.0, 1.0, 0.0]), late)
    print_advice(Advice([link], [], [TraceCost(1, 6, 33, 31, 0.2)], 10.0))
    assert "end: beyond the receiver's delays" in capsys.readouterr().out


def test_a_map_without_any_direct_path_is_drawn_all_the_same(tmp_path: Path) -> None:
    scene = load_scene(ROOT / "scenes" / "paper_room")
    axis = np.linspace(0.0, 6.0, 5)
    nothing = Coverage("ris", axis, axis, 0.5, np.full((5, 5), np.nan))
    assert nothing.heard == 0.0
    half = Coverage("second", axis, axis, 0.5, np.tile([-3.0, -1.0, np.nan, 2.0, 4.0], (5, 1)))
    assert half.heard == 0.5
    file = draw_coverage(scene, [nothing, half], tmp_path / "map.svg")
    text = file.read_text()
    assert "<svg" in text


@pytest.mark.parametrize(("name", "wide"), [("kitchen", 1.0), ("a room of so long a name that no line holds it", 0.2)])
def test_the_title_of_the_coverage_map_is_within_the_picture_and_beside_nothing(
    name: str, wide: float, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also of a room that is much longer than wide, whose plan is narrow."""
    scene = load_scene(ROOT / "scenes" / "paper_room")
    walls = [replace(r, vertices=r.vertices * [wide, 1.0, 1.0]) for r in scene.reflectors]
    scene = replace(scene, name=name, reflectors=tuple(walls))
    drawn = []
    monkeypatch.setattr(advice, "save_figure", lambda figure, path: drawn.append(figure) or path)
    x, y = np.linspace(0.1, 6.0 * wide - 0.1, 20), np.linspace(0.1, 5.9, 20)
    one = Coverage("panel", x, y, 1.2, np.full((20, 20), 25.0))
    draw_coverage(scene, [one, one], tmp_path / "map.png")
    canvas = FigureCanvasAgg(drawn[0])
    canvas.draw()
    picture = drawn[0].bbox
    titles = [one.get_window_extent() for one in drawn[0].findobj(Text) if one.get_text().endswith("it is seen")]
    scales = [axis.get_tightbbox() for axis in drawn[0].findobj(Axes) if axis.get_label() == "<colorbar>"]
    assert len(titles) == len(scales) == 2
    for title in titles:
        assert picture.x0 < title.x0 < title.x1 < picture.x1
        assert picture.y0 < title.y0 < title.y1 < picture.y1
        assert not any(title.overlaps(scale) for scale in scales)
