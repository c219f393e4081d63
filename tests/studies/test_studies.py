"""Studies: their files on tiny settings, what is said of bad ones, and what their numbers must obey."""

import csv
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.compare import validate_rooms
from rislam_rt.cli import main
from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.pipeline import PipelineSpec, load_spec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.report.studies.channel_validation import draw_certificate, validation_page
from rislam_rt.report.studies.fig4a import claims, fig4a_csv, fig4a_page, findings_of
from rislam_rt.report.style import to_png
from rislam_rt.scene import load_scene
from rislam_rt.storage.files import MARK
from rislam_rt.studies import CompareSpec, Fig4aSpec, load_any
from rislam_rt.studies.channel_validation import run_comparison
from rislam_rt.studies.fig4a import longer_side, run_fig4a, sphere_gain, walk_to_panel
from rislam_rt.studies.spec import distinct_scenes, study_record

ROOT = Path(__file__).parents[2]
FIG4A, COMPARE, SLAM = (ROOT / "pipelines" / f"{n}.toml" for n in ("fig4a", "compare_channels", "trace_then_slam"))
TINY = ("channel=image_source", "places=4", "seeds=3", "draws=200", "design.iterations=20")
BOX = f"rooms=[{{scene='{ROOT}/scenes/empty_box', depth=1, picture=true}}, {{scene='{ROOT}/scenes/l_room', depth=1}}]"


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """`rislam-rt run` in an empty folder; returns exit code, output and error stream."""
    monkeypatch.chdir(tmp_path)

    def _run(pipeline, *settings, more=()):
        words = [word for setting in settings for word in ("--set", setting)]
        monkeypatch.setattr(sys, "argv", ["rislam-rt", "run", str(pipeline), *words, *map(str, more)])
        with pytest.raises(SystemExit) as left:
            main()
        captured = capsys.readouterr()
        return left.value.code, captured.out, captured.err

    return _run


@pytest.fixture(scope="module")
def room():
    return load_scene(ROOT / "scenes" / "paper_room")


@pytest.fixture(scope="module")
def tiny():
    return load_any(FIG4A, TINY)


@pytest.fixture(scope="module")
def curves(room, tiny):
    return run_fig4a(room, tiny, rng=np.random.default_rng(7))


def test_kind_decides_what_a_file_is():
    assert [type(load_any(path)) for path in (SLAM, COMPARE, FIG4A)] == [PipelineSpec, CompareSpec, Fig4aSpec]
    assert load_any(SLAM) == load_spec(SLAM)
    with pytest.raises(ConfigError, match="kind: 'fig4a' received"):
        load_spec(FIG4A)


@pytest.mark.parametrize("path", [COMPARE, FIG4A], ids=lambda path: path.stem)
def test_specification_survives_its_own_dump(path):
    spec = load_any(path)
    assert type(spec).model_validate(spec.model_dump(mode="json")) == spec
    assert all((path.parent / scene).is_dir() for scene in [r.scene for r in getattr(spec, "rooms", [])])


@pytest.mark.parametrize(
    ("pipeline", "setting", "field"),
    [
        (SLAM, "kind=fig5", "kind"),
        (SLAM, "kind=3", "kind"),
        (SLAM, "kind=[1]", "kind"),
        (COMPARE, "poses=0", "poses"),
        (COMPARE, "rooms=[]", "rooms"),
        (COMPARE, "rooms=[{depth=1}]", "rooms[0].scene"),
        (COMPARE, "rooms=[{scene='a', dept=1}]", "did you mean 'depth'"),
        (COMPARE, "rooms=[{scene='a'}, {scene='a'}]", "at most once"),
        (COMPARE, "rooms=[{scene='a'}]", "scene"),
        (COMPARE, "radio.carrier_ghz=-1", "radio.carrier_ghz"),
        (COMPARE, "schemes=['random']", "schemes"),
        (FIG4A, "places=1", "places"),
        (FIG4A, "coverage=1.0", "coverage"),
        (FIG4A, "elements=['cosine']", "elements[0]"),
        (FIG4A, "elements=['tang','tang']", "at most once"),
        (FIG4A, "design.population=3", "design.population"),
        (FIG4A, "closest_m=50.0", "closest_m"),
        (FIG4A, "scene=empty_box", "panel"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(run, tmp_path, pipeline, setting, field):
    code, out, err = run(pipeline, setting)
    lines = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert (code, out, len(lines)) == (2, "", 1)
    assert field in lines[0]
    assert list(tmp_path.iterdir()) == []


def test_options_that_do_not_fit_are_refused(run, tmp_path):
    code, _, err = run(COMPARE, more=("--scene", ROOT / "scenes" / "empty_box"))
    assert code == 2
    assert "rooms" in err
    (tmp_path / "taken").write_text("")
    code, _, err = run(FIG4A, *TINY, more=("--out", "taken"))
    assert code == 2
    assert "--out taken" in err


def test_fig4a_writes_page_figure_and_data(run, tmp_path):
    code, out, _ = run(FIG4A, *TINY, "elements=['energy']", more=("--json", "copy.json"))
    assert code == 0
    folder = next((tmp_path / "runs").glob("fig4a-paper_room-7-*"))
    assert {p.relative_to(folder).as_posix() for p in folder.rglob("*.*")} == {
        "fig4a.md", "fig4a.csv", "fig4a.json", "figures/fig4a.png",
    }  # fmt: skip
    content = json.loads((folder / "fig4a.json").read_text())
    assert content | {"origin": MARK} == json.loads((tmp_path / "copy.json").read_text())
    assert content["config"]["places"] == 4
    assert content["versions"]["rislam-rt"]
    assert len(content["scenes"]["paper_room"]["sha256"]) == 64
    assert "optimised above the sphere: at all 4 places" in out
    before = {p.name: p.read_bytes() for p in folder.rglob("*.*")}
    assert run(FIG4A, *TINY, "elements=['energy']")[0] == 0
    assert {p.name: p.read_bytes() for p in folder.rglob("*.*")} == before


def test_curves_keep_what_must_hold(room, tiny, curves):
    for element, found in curves.curves.items():
        assert (found.optimized.high <= found.exact + 1e-9).all()
        assert (found.exact <= found.continuous + 1e-9).all()
        order = claims(curves, found)
        assert order["optimised above random codes, intervals apart"].all()
        assert order["optimised above the sphere"].all()
        # the paper's pattern falls faster than a sphere does, so that random codes lose to it far off
        assert order["random codes (RMS) above the sphere"].all() == (element == "energy")
    assert (np.diff(curves.distance) < 0.0).all()
    assert np.linalg.norm(curves.position[-1, :2] - room.ris.center[:2]) == pytest.approx(tiny.closest_m)
    np.testing.assert_allclose(curves.position[0], room.agent.position[0])


def test_sphere_follows_the_radar_equation(room, tiny):
    motion, radio = walk_to_panel(room, 3, 0.2), build_radio(tiny.radio)
    radius = 0.5 * longer_side(room.ris)
    assert radius == pytest.approx(0.045)
    gain = sphere_gain(room, motion, radio, radius, "image_source")
    center = room.ris.center - [0.0, 0.0, radius]
    legs = np.linalg.norm(motion.tx - center, axis=1) * np.linalg.norm(motion.rx - center, axis=1)
    expected = radio.wavelength * np.sqrt(np.pi) * radius / ((4.0 * np.pi) ** 1.5 * legs)
    np.testing.assert_allclose(gain, 20.0 * np.log10(expected), atol=1e-9)


def test_traced_and_analytic_curves_agree(room, tiny):
    short = tiny.model_copy(update={"elements": ["tang"], "places": 2})
    traced, analytic = (
        run_fig4a(room, short.model_copy(update={"channel": channel}), rng=np.random.default_rng(1))
        for channel in ("traced", "image_source")
    )
    np.testing.assert_allclose(traced.sphere, analytic.sphere, atol=1e-3)  # float32 gains
    np.testing.assert_allclose(traced.curves["tang"].exact, analytic.curves["tang"].exact, atol=1e-3)


def test_table_says_what_the_curves_say(room, tiny, curves):
    rows = list(csv.DictReader(fig4a_csv(curves).decode().splitlines()))
    assert [row["element"] for row in rows] == ["tang"] * 4 + ["energy"] * 4
    np.testing.assert_allclose([float(row["exact_db"]) for row in rows[4:]], curves.curves["energy"].exact, atol=1e-4)
    page = fig4a_page(curves, tiny, room.name, None)
    assert "![" not in page
    assert all(line in page for line in findings_of(curves, "tang"))


def test_verdict_names_the_distances_where_an_order_fails(curves):
    below = curves._replace(sphere=np.full(4, -1e3))
    assert "- random codes (RMS) above the sphere: at all 4 places" in findings_of(below, "tang")
    middle = curves.curves["tang"].random.middle
    mixed = curves._replace(sphere=middle + np.array([1.0, 1.0, -1.0, -1.0]))
    line = f"at 2 of 4 places; it fails from {curves.distance[1]:.2f} m to {curves.distance[0]:.2f} m"
    assert any(line in text for text in findings_of(mixed, "tang"))
    above = curves._replace(sphere=np.zeros(4))
    assert "- optimised above the sphere: at none of 4 places" in findings_of(above, "tang")


def test_compare_writes_the_page_of_its_functions(run, tmp_path, undrawn):
    code, out, _ = run(COMPARE, "poses=3", BOX, more=("--out", "docs", "--jobs", 1))
    assert code == 0
    assert "unexplained" in out
    rooms = [(load_scene(ROOT / "scenes" / name), 1) for name in ("empty_box", "l_room")]
    page = validation_page(validate_rooms(rooms, RadioConfig(), poses=3, seed=7), seed=7)
    assert (tmp_path / "docs" / "channel_validation.md").read_text() == page
    content = json.loads((tmp_path / "docs" / "channel_validation.json").read_text())
    assert content["unexplained"] == 0
    assert [row["scene"] for row in content["rooms"]] == ["empty_box"] * 2 + ["l_room"] * 2
    assert set(content["scenes"]) == {"empty_box", "l_room"}
    assert (tmp_path / "docs" / "figures" / "path_certificate.png").read_bytes().startswith(b"\x89PNG")


def test_every_room_of_a_study_is_in_its_record_by_a_name_of_its_own():
    """Copies have one name; the record is what the folder's name is made of."""
    room = load_scene(ROOT / "scenes" / "empty_box")
    copies = [replace(room, digest=letter) for letter in "abc"]
    names = ["empty_box", "empty_box (2)", "empty_box (3)"]
    assert [scene.name for scene in distinct_scenes(copies)] == names
    record = study_record(load_any(COMPARE), copies)
    assert record["scenes"] == {name: {"sha256": letter} for name, letter in zip(names, "abc", strict=True)}


def test_an_unexplained_path_is_exit_1_and_still_written(run, tmp_path, monkeypatch):
    import rislam_rt.studies.channel_validation as module
    from rislam_rt.channel.compare import OneSidedPath, Validation

    def broken(*arguments, **options):
        found = validate_rooms(*arguments, **options)
        lost = OneSidedPath(0, "LOS", "analytic", "", "all its conditions hold", 0.0)
        return [Validation(*row[:3], replace(row.report, one_sided=(*row.report.one_sided, lost))) for row in found]

    monkeypatch.setattr(module, "validate_rooms", broken)
    one = f"rooms=[{{scene='{ROOT}/scenes/empty_box', depth=0}}]"
    code, out, _ = run(COMPARE, "poses=2", one, more=("--out", "mine"))
    assert code == 1
    assert "unexplained: empty_box, traced, pose 0, LOS, only analytic" in out
    assert json.loads((tmp_path / "mine" / "channel_validation.json").read_text())["unexplained"] == 2
    assert not (tmp_path / "mine" / "figures").exists()


def test_certificate_shows_the_pose_with_the_most_differences():
    scene = load_scene(ROOT / "scenes" / "l_room")
    spec = load_any(COMPARE, ["poses=4", f"rooms=[{{scene='{ROOT}/scenes/l_room', depth=1, picture=true}}]"])
    certificate = run_comparison([scene], spec).certificate
    assert certificate.report.matched == np.sum(certificate.traced.valid & certificate.analytic.valid)
    assert len(certificate.scene.agent) == 1
    plain = to_png(draw_certificate(certificate))
    # take the floor's paths from the traced side: they must show up as the analytic side's own
    from rislam_rt.channel.compare import compare_paths

    floor = certificate.traced.walls.index("floor")
    bounce = (certificate.traced.kind == PathKind.VT) & (certificate.traced.tx_walls == floor).any(axis=1)
    lacking = replace(certificate.traced, valid=certificate.traced.valid & ~bounce)
    report = compare_paths(lacking, certificate.analytic, certificate.scene, certificate.scene.agent)
    assert [path.label for path in report.one_sided] == ["VT floor"]
    assert report.unexplained == 1
    assert to_png(draw_certificate(certificate._replace(traced=lacking, report=report))) != plain


def test_least_snr_is_given_in_db():
    assert load_spec(SLAM).design.least_snr == 0.0
    assert load_spec(SLAM, ["design.least_snr_db=10.0"]).design.least_snr == pytest.approx(10.0)
    assert load_spec(SLAM, ["design.least_snr_db=-3.0"]).design.least_snr == pytest.approx(0.501187, rel=1e-6)
