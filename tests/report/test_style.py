"""The style of the figures: every scheme of a figure looks its own, whoever looks, and nothing is cut off."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.report.code_pictures import draw_run_codes
from rislam_rt.report.exports import animation
from rislam_rt.report.map_from_above import draw_above
from rislam_rt.report.page import CAPTIONS
from rislam_rt.report.room_figures import draw_scene
from rislam_rt.report.style import OWN, OWN_MARKER, SCHEME, scheme_styles, styled
from rislam_rt.report.time_curves import draw_agent_error, draw_landmark_errors, draw_levels, draw_timing
from rislam_rt.report.view.run_data import run_data
from rislam_rt.scene import load_scene

EYES = {
    "all cones": np.eye(3),
    "no M cones": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "no L cones": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
}
"""What is seen of linear red, green and blue (Machado et al. 2009)."""
NAMES = ("optimized", "random", "exact", "mine:my_designer", "mine:Beams", "mine:DeadReckoning")
FIGURES = {
    "error": draw_agent_error, "landmarks": draw_landmark_errors, "levels": lambda run: draw_levels(run, 10.0, 13.0),
    "timing": lambda run: draw_timing(run, (1.0,)), "room": draw_above, "codes": draw_run_codes,
}  # fmt: skip


def lab(colour, eye):
    """CIELAB of a colour as an eye sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(to_xyz @ np.clip(np.array(EYES[eye]) @ linear, 1e-3, 1.0) / [0.9505, 1.0, 1.089])
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.fixture(scope="module")
def six(run_short):
    """A run of six schemes, three of them not built in."""
    run = run_short("receiver.estimator=bound", 'schemes=["random"]')
    (scheme,) = run.schemes.values()
    return replace(run, schemes={name: replace(scheme, scheme=name) for name in NAMES})


@pytest.mark.parametrize("eye", EYES)
def test_colours_of_all_schemes_can_be_told_apart(eye):
    colours = [style.colour for style in scheme_styles([*SCHEMES, *(f"mine:f{i}" for i in range(len(OWN)))]).values()]
    assert len(colours) == len(SCHEMES) + len(OWN)
    least = min(np.linalg.norm(lab(a, eye) - lab(b, eye)) for a, b in itertools.combinations(colours, 2))
    assert least > 9.0


def test_built_in_schemes_look_alike_everywhere_and_own_ones_as_nobody_else():
    alone, among = scheme_styles(["exact"]), scheme_styles(["mine:f", "exact", "mine:g"])
    assert alone["exact"] == among["exact"]
    own = [f"mine:f{i}" for i in range(len(OWN) * len(OWN_MARKER))]
    styles = scheme_styles([*SCHEMES, *own])
    assert len({styles[name] for name in (*SCHEMES, *own)}) == len(SCHEMES) + len(own)
    assert set(SCHEME) == set(SCHEMES)


@pytest.mark.parametrize("name", ["error", "landmarks", "levels"])
def test_curves_of_a_run_have_a_colour_and_a_marker_each(six, name):
    figure = FIGURES[name](six)
    handles = [handle for handle in figure.legends[0].legend_handles if handle.get_marker() not in ("", "None", None)]
    looks = {(handle.get_color(), handle.get_marker()) for handle in handles}
    assert len({colour for colour, _ in looks}) == len(looks) == len(NAMES)
    others = {handle.get_color() for handle in figure.legends[0].legend_handles} - {colour for colour, _ in looks}
    assert all(len(set(to_rgb(colour))) == 1 for colour in others)  # what is no scheme is grey


def test_markers_of_curves_that_lie_on_each_other_do_not(run_short):
    run = run_short("receiver.estimator=bound", "cycles=24", 'schemes=["no_ris"]')
    (scheme,) = run.schemes.values()
    three = replace(run, schemes={name: replace(scheme, scheme=name) for name in NAMES[-3:]})
    (axis,) = draw_agent_error(three).axes
    first = [line.get_markevery()[0] for line in axis.lines if line.get_linestyle() == "-"]
    assert sorted(first) == [0, 1, 2]


def test_views_and_animations_of_a_run_have_its_colours(six):
    wanted = [scheme_styles(NAMES)[name].colour for name in NAMES]
    assert [scheme["colour"] for scheme in run_data(six)["schemes"]] == wanted
    with styled():
        _, _, near = animation._empty_frame(six)
    assert [handle.get_color() for handle in near.get_legend().legend_handles[: len(NAMES)]] == wanted
    maps = draw_above(six).axes
    assert [{line.get_color() for line in axis.lines} & set(wanted) for axis in maps] == [{one} for one in wanted]


def inside(figure):
    """Whether all that a figure shows lies within it."""
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    box, page = figure.get_tightbbox().transformed(figure.dpi_scale_trans), figure.bbox
    return page.x0 <= box.x0 < box.x1 <= page.x1 and page.y0 <= box.y0 < box.y1 <= page.y1


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("count", [pytest.param(1, marks=pytest.mark.slow), 3, 6])
def test_no_figure_of_a_run_is_cut_off(six, name, count):
    schemes = dict(list(six.schemes.items())[-count:])
    figure = FIGURES[name](replace(six, schemes=schemes))
    assert inside(figure)
    assert figure.get_figwidth() < 16.5


@pytest.mark.parametrize("room", ["l_room", "large_hall", "paper_room"])
def test_the_picture_of_a_room_is_not_cut_off(room, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("rislam_rt.report.room_figures.save_figure", lambda figure, path: drawn.append(figure))
    draw_scene(load_scene(room), tmp_path / "room.png")
    assert inside(drawn[0])


def test_the_title_of_an_animation_is_not_cut_off(six):
    with styled():
        figure, room, near = animation._empty_frame(six)
        animation._draw_moment(room, near, six, 3)
    assert inside(figure)


def test_a_short_run_shows_each_code_once(run_short):
    figure = draw_run_codes(run_short("cycles=3", 'schemes=["random"]'))
    titles = [axis.get_title(loc="left") for axis in figure.axes[:-1]]
    assert [title.partition(" s")[0] for title in titles] == ["t = 0.0", "t = 0.1", "t = 0.2"]
    assert "five" not in CAPTIONS["codes"]
