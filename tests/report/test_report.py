"""The report: lines that are drawn, figures that exist, a page that needs nothing else."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.walls import build_walls
from rislam_rt.model import Material, PathKind
from rislam_rt.pipeline.scores.loss_causes import WORDS
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.report import draw_figures
from rislam_rt.report.drawing_geometry import ellipse, plane_trace, section, wall_edges
from rislam_rt.report.page import build_page
from rislam_rt.report.room_figures import path_points
from rislam_rt.report.terminal_tables import summary_rows
from rislam_rt.report.time_curves import strongest_db
from rislam_rt.slam.step_info import LossCause


def test_a_run_of_one_cycle_is_drawn_without_a_complaint(run_short):
    one = run_short("cycles=1", "slam.num_samples=40", 'schemes=["no_ris"]')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw_figures(one)


def test_outline_has_no_diagonals(result):
    edges = wall_edges(build_walls(result.scene))
    along = np.abs(edges[:, 1] - edges[:, 0])
    assert len(edges) == 24  # six walls, four sides each
    assert (np.sum(along > 1e-9, axis=1) == 1).all()


@pytest.mark.parametrize(("height", "x"), [(0.0, 2.0), (1.0, 2.5)])
def test_trace_of_a_leaning_wall_moves_with_height(height, x):
    normal = np.array([2.0, 0.0, -1.0]) / np.sqrt(5.0)
    box = np.array([[0.0, 0.0, 0.0], [6.0, 4.0, 3.0]])
    segment = plane_trace(normal, 4.0 / np.sqrt(5.0), height, box)
    np.testing.assert_allclose(segment[:, 0], x)
    np.testing.assert_allclose(np.sort(segment[:, 1]), [0.0, 4.0])


def test_trace_ends_at_the_box():
    normal, box = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), np.array([[0.0, 0.0, 0.0], [6.0, 4.0, 3.0]])
    segment = plane_trace(normal, 3.0 / np.sqrt(2.0), 0.0, box)
    np.testing.assert_allclose(segment[np.argsort(segment[:, 0])], [[0.0, 3.0], [3.0, 0.0]], atol=1e-12)


def test_section_of_a_room_is_its_plan(result):
    walls = build_walls(result.scene)
    cut = section(walls.triangles, 0.5)
    length = np.linalg.norm(cut[:, 1] - cut[:, 0], axis=1).sum()
    assert length == pytest.approx(24.0)
    assert len(section(walls.triangles, 5.0)) == 0


def test_section_through_a_corner_is_kept():
    triangle = np.array([[[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [2.0, 2.0, 2.0]]])
    np.testing.assert_allclose(section(triangle, 1.0), [[[0.0, 0.0], [2.0, 1.0]]])


def test_floors_and_distant_planes_have_no_trace():
    box = np.array([[0.0, 0.0, 0.0], [6.0, 4.0, 3.0]])
    assert plane_trace(np.array([0.0, 0.0, 1.0]), 0.5, 0.5, box) is None
    assert plane_trace(np.array([1.0, 0.0, 0.0]), 9.0, 0.5, box) is None


def test_ellipse_lies_at_its_mahalanobis_distance():
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    offset = ellipse(np.array([1.0, -1.0]), covariance, 2.0) - [1.0, -1.0]
    distance = np.einsum("ni,ij,nj->n", offset, np.linalg.inv(covariance), offset)
    np.testing.assert_allclose(distance, 4.0)


def test_drawn_paths_have_the_length_of_their_delays(result):
    paths = result.paths
    for path in np.flatnonzero(paths.valid[2]):
        points = path_points(result.scene, paths, 2, int(path))
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert length == pytest.approx(299_792_458.0 * paths.tau[2, path], abs=1e-9)


def test_strongest_path_of_a_class(result):
    scheme = result.schemes["random"]
    columns = result.paths.kind == PathKind.VT
    level = strongest_db(scheme, columns)
    np.testing.assert_allclose(10.0 ** (level / 20.0), np.abs(scheme.gain[:, columns]).max(axis=1))
    assert np.isnan(strongest_db(result.schemes["no_ris"], result.paths.kind == PathKind.RIS)).all()


@pytest.fixture(scope="module")
def figures(result):
    return draw_figures(result)


def test_every_figure_is_drawn_and_none_is_blank(figures):
    import io

    from matplotlib.image import imread

    assert set(figures) == {"room", "error", "landmarks", "levels", "paths", "codes", "timing"}
    for picture in figures.values():
        pixels = imread(io.BytesIO(picture))
        assert min(pixels.shape[:2]) > 200
        assert 0.005 < np.mean(pixels[..., :3].min(axis=-1) < 0.98) < 0.9


def test_page_needs_no_other_file(result, figures):
    page = build_page(result, summarise(result), figures)
    assert page.count("data:image/png;base64,") == 7
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert page.count("<script") == page.count("</script>") == 2  # the map's data, and what draws it
    assert "wall wall_x0" in page


def test_nothing_from_a_file_can_break_the_page(result):
    evil = "<script>alert(1)</script>"
    summary = summarise(result)
    one = summary["schemes"].pop("random")
    summary = {**summary, "seed": evil, "cycles": evil, "schemes": {evil: one, **summary["schemes"]}}
    schemes = {evil: result.schemes["random"], "no_ris": result.schemes["no_ris"]}
    broken = replace(
        result, name=evil, seed=evil, schemes=schemes, scene=replace(result.scene, name=evil, digest=evil),
        paths=replace(result.paths, source=evil), versions={evil: evil}, warnings=(evil,),
    )  # fmt: skip
    page = build_page(broken, summary, {})
    assert page.count("<script") == page.count("</script>") == 2  # the map's data, and what draws it
    assert evil not in page
    # title and heading: run and room; version: name and number; the scheme: verdict, list, table; all else once
    assert page.count("&lt;script&gt;") == 14


def test_warnings_stand_on_the_page(result):
    warned = replace(result, warnings=("ris: too wide for <the band>",))
    assert "Warning: ris: too wide for &lt;the band&gt;" in build_page(warned, summarise(warned), {})
    assert "Warning" not in build_page(result, summarise(result), {})


def test_a_pane_that_the_carrier_passes_stands_on_the_page(result):
    scene = result.scene
    pane = replace(scene.reflectors[0], material=Material(itu="glass", thickness=0.006))
    glazed = replace(result, scene=replace(scene, reflectors=(pane, *scene.reflectors[1:])))
    said = "6 mm of &#x27;glass&#x27; reflect 0.04 of the amplitude at 10 GHz"
    assert said in build_page(glazed, summarise(result), {})
    assert said not in build_page(result, summarise(result), {})


def test_page_says_what_is_lost_and_what_held_itself_for_lost(run_short):
    """A start told wrong by a metre and a metre a second, against one told right."""
    rows = {}
    for scale in (100, 1):
        lost = run_short("cycles=10", 'schemes=["no_ris"]', f"told.start_scale={scale}")
        rows[scale] = dict(summary_rows(summarise(lost)))
        page = build_page(lost, summarise(lost), {})
        assert ("diverged with no panel." in page) == (scale == 100)
        assert f"<td>{rows[scale]['held itself for lost']}</td>" in page
        assert ("told at the start</li>" in page) == (scale == 100)
    keys = ("agent", "agent, relative to its start", "agent, path aligned")
    whole, relative, shape = (float(rows[1][key].removesuffix(" cm")) for key in keys)
    assert max(relative, shape) < whole, "most of an honest run's error is the start's"
    assert "within 1 cm an axis" in page
    assert (rows[1]["diverged"], rows[1]["held itself for lost"]) == ("no", "never")
    assert rows[100]["diverged"] == "yes"
    assert re.fullmatch("in [1-9] of 10 cycles", rows[100]["held itself for lost"])
    assert rows[100]["because"] == WORDS[LossCause.START]
    assert "because" not in rows[1]
