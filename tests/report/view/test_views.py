"""The views: their data are the room's and the run's, and their pages are whole, sound and need no network."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Scene, SlamResult
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.report.exports.animation import gif_bytes
from rislam_rt.report.page import build_page
from rislam_rt.report.view.page import SCRIPTS, view_fragment, view_page, view_script
from rislam_rt.report.view.paths_data import MOST_PATHS, paths_data, poses_of
from rislam_rt.report.view.room_data import room_data, spread
from rislam_rt.report.view.run_data import run_data
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[3]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
MILLIMETRE = 0.5e-3 * np.sqrt(3.0)  # a point rounded to it is off by half of one along each axis
VOID = ("meta", "img", "br", "input", "link")


class Reader(HTMLParser):
    """Reads a page; remembers what is open, and what the scripts hold."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        if tag == "script":
            self.scripts.append((dict(attrs), ""))
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            attributes, text = self.scripts[-1]
            self.scripts[-1] = attributes, text + data


def read(page: str) -> tuple[Reader, list[object]]:
    """A sound page without any address, and its embedded data."""
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    assert all(link.startswith("data:") for link in reader.links)
    code = "".join(text for attributes, text in reader.scripts if "type" not in attributes)
    assert code.strip() == view_script().strip()
    data = [json.loads(text) for attributes, text in reader.scripts if attributes.get("type") == "application/json"]
    return reader, data


@pytest.fixture(scope="module")
def paper() -> Scene:
    return load_scene(ROOT / "scenes" / "paper_room")


def test_nothing_is_loaded_from_anywhere() -> None:
    script = view_script()
    for word in ("http:", "https:", "fetch(", "XMLHttpRequest", "import ", "import(", "//cdn", "eval(", "innerHTML"):
        assert word not in script
    assert sum(name in script for name in ("class Camera", "class Painter", "class View", "class Beliefs")) == 4


@pytest.mark.skipif(shutil.which("node") is None, reason="no JavaScript engine here")
def test_the_script_is_sound_and_its_camera_looks_where_it_says(tmp_path: Path) -> None:
    (tmp_path / "all.js").write_text(view_script())
    subprocess.run(["node", "--check", tmp_path / "all.js"], check=True, timeout=60)
    trial = (
        (ROOT / "rislam_rt" / "report" / "view" / SCRIPTS[0]).read_text()
        + """
const camera = new Camera([[0, 0, 0], [6, 4, 3]]);
camera.frame(600, 400);
camera.lookDown();
const plan = [[0, 0, 0], [6, 4, 3], [3, 2, 1.5]].map((p) => camera.place(p));
camera.lookAcross();
const corners = camera.corners.map((p) => camera.place(p));
console.log(JSON.stringify({ plan, corners }));
"""
    )
    (tmp_path / "trial.js").write_text(trial)
    done = subprocess.run(["node", tmp_path / "trial.js"], check=True, timeout=60, capture_output=True, text=True)
    said = json.loads(done.stdout)
    (left, low, _), (right, high, _), (x, y, _) = said["plan"]
    assert (x, y) == pytest.approx((300, 200))
    assert (right - left) / (low - high) == pytest.approx(6 / 4)  # x to the right, y up, one scale
    places = np.array(said["corners"])
    assert (places[:, :2] >= 0.0).all()
    assert (places[:, :2] <= [600, 400]).all()
    assert places[:, :2].max() > 300


def test_data_cannot_end_their_script() -> None:
    hostile = {"name": "</script><script>alert(1)</script><!-- ünïcode"}
    _, (found,) = read(f"<html><body>{view_fragment(hostile)}<script>{view_script()}</script></body></html>")
    assert found == hostile


def test_walls_are_the_rooms(paper: Scene) -> None:
    data = room_data(paper)
    assert [wall["label"] for wall in data["walls"]].count("") == 0
    assert {wall["name"] for wall in data["walls"]} == {r.name for r in paper.reflectors}
    for wall in data["walls"]:
        corners, normal = np.array(wall["triangles"]), np.array(wall["normal"])
        assert np.abs(corners @ normal - wall["offset"]).max() < MILLIMETRE
        assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ normal > 0.0).all()
        assert len(wall["edges"]) == 4
    panel = np.array(data["panels"][0]["corners"])
    assert np.linalg.norm(panel[1] - panel[0]) == pytest.approx(6 * 0.015, abs=2 * MILLIMETRE)
    assert data["track"][0] == [0.5, 0.7, 0.5]
    assert len(data["track"]) <= 600


def test_paths_are_those_found_with_their_lengths_and_margins(paper: Scene) -> None:
    settings = build_settings(load_spec(PIPELINE))
    motion = paper.agent[:600:300]
    paths = ImageSourceChannel(paper, settings.radio, 1).paths(motion)
    _, (data,) = read(view_page("a <room>", "two & poses", paths_data(paper, motion, paths, settings)))
    assert isinstance(data, dict)
    assert data["time"] == [0.0, 30.0]
    for pose, found in enumerate(data["poses"]):
        assert len(found["paths"]) == paths.valid[pose].sum()
        for path in found["paths"]:
            points = np.array(path["p"])
            length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            assert length == pytest.approx(path["d"], abs=2 * MILLIMETRE * len(points))
            assert np.linalg.norm(points[0] - motion.tx[pose]) < MILLIMETRE
            snr = float(settings.radio.integrated_snr(np.array(10.0 ** (path["g"] / 20.0))))
            assert path["s"] == pytest.approx(10.0 * np.log10(snr / settings.sensor.threshold), abs=0.11)
    (panel,) = (path for path in data["poses"][1]["paths"] if path["k"] == "RIS")
    assert panel["s"] > 20.0  # aimed at the agent; at level 0 it would not be heard
    assert len(poses_of(paper, 1000)) == MOST_PATHS // 1000
    assert spread(3, 60).tolist() == [0, 1, 2]


def test_a_runs_data_are_its_estimates(result: SlamResult) -> None:
    data = run_data(result)
    truth = result.scene.agent.position
    for scheme, found in zip(result.schemes.values(), data["schemes"], strict=True):
        np.testing.assert_allclose(found["position"], scheme.position, rtol=0, atol=0.51e-4)
        error = np.linalg.norm(scheme.position - truth, axis=1)
        np.testing.assert_allclose(np.array(found["error"])[:, 0], error, rtol=0, atol=0.51e-4)
        for (a, b, angle), covariance in zip(found["ellipse"], scheme.covariance[:, :2, :2], strict=True):
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            np.testing.assert_allclose(turn @ np.diag([a**2, b**2]) @ turn.T / 4.0, covariance, rtol=0, atol=2e-6)
        count = sum(place is not None for mark in found["landmarks"] for place in mark["at"])
        assert count == scheme.held.sum()
        assert found["lost"] == "0" * len(truth)
    assert "codes" not in data["schemes"][1]
    scheme, codes = result.schemes["random"], data["schemes"][0]["codes"]
    again = [[int(digit, 36) for digit in code] for code in codes]
    assert np.array_equal(again, scheme.applied.reshape(6, -1))


def test_a_run_that_holds_itself_for_lost_says_so(result: SlamResult, monkeypatch: pytest.MonkeyPatch) -> None:
    import rislam_rt.report.view.run_data as module

    told = ("ok", "diverged", "ok", "ok", "ok", "ok")
    lost = replace(result, schemes={n: replace(one, outcome=told) for n, one in result.schemes.items()})
    assert [one["lost"] for one in run_data(lost)["schemes"]] == ["010000"] * len(lost.schemes)
    monkeypatch.setattr(module, "FRAMES", 3)  # cycles that have no moment of their own count in the next
    assert [one["lost"] for one in run_data(lost)["schemes"]] == ["010"] * len(lost.schemes)


@pytest.mark.skipif(shutil.which("node") is None, reason="no JavaScript engine here")
def test_the_view_tells_a_filter_that_holds_itself_for_lost(result: SlamResult, tmp_path: Path) -> None:
    told = ("ok", "ok", "diverged", "ok", "ok", "ok")
    lost = replace(result, schemes={n: replace(one, outcome=told) for n, one in result.schemes.items()})
    trial = f"""
const document = {{ querySelectorAll: () => [] }};
{view_script()}
const data = {json.dumps(run_data(lost))};
const dashes = [], on = {{}};
for (const scheme of data.schemes) on[scheme.name] = true;
const painter = {{ point() {{}}, name() {{}}, line(p, c, w, a, dash) {{ if (dash && dash.length) dashes.push(c); }} }};
const words = [0, 2].map((at) => {{
  const own = Object.assign(Object.create(Beliefs.prototype),
    {{ view: {{ painter, data, state: {{ on }}, said: {{}} }}, codes: [], closeUp() {{}} }});
  own.draw(at);
  return own.view.said.textContent;
}});
console.log(JSON.stringify({{ words, dashes: dashes.length, schemes: data.schemes.length }}));
"""
    (tmp_path / "trial.js").write_text(trial)
    done = subprocess.run(["node", tmp_path / "trial.js"], check=True, timeout=60, capture_output=True, text=True)
    said = json.loads(done.stdout)
    assert said["words"][0].count("holds itself for lost") == 0
    assert said["words"][1].count("holds itself for lost") == said["dashes"] == said["schemes"]


def test_codes_of_many_levels_and_of_several_panels_are_told_apart(result: SlamResult) -> None:
    from rislam_rt.report.view.run_data import _code

    scheme = replace(result.schemes["random"], levels=64, applied=np.arange(6 * 36).reshape(6, 6, 6) % 64)
    text = _code(scheme, 5, [[2, 6], [4, 6]])
    first, second = text.split("|")
    assert len(first) == 2 * 12
    levels = [int((first + second)[k : k + 2], 36) for k in range(0, 72, 2)]
    assert levels == scheme.applied[5].ravel().tolist()


def test_the_report_begins_with_verdict_and_map(result: SlamResult) -> None:
    page = build_page(result, summarise(result), {})
    _, (data,) = read(page)
    assert isinstance(data, dict)
    assert data["kind"] == "run"
    assert len(data["time"]) == 6
    assert page.index('class="verdict"') < page.index('class="rv"') < page.index("<h2>RMSE")
    assert not re.search(r"https?://", page)


def test_a_moving_picture_has_a_frame_a_moment(result: SlamResult, tmp_path: Path) -> None:
    from PIL import Image

    (tmp_path / "run.gif").write_bytes(gif_bytes(result))
    with Image.open(tmp_path / "run.gif") as picture:
        assert picture.n_frames == 6  # type: ignore[attr-defined]
        assert picture.size[0] == 640
        assert picture.info["loop"] == 0
        first = np.asarray(picture.convert("RGB"))
        picture.seek(5)
        assert (np.asarray(picture.convert("RGB")) != first).any()
