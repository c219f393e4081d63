"""Late paths of a room are named once, with a setting that makes them heard; small rooms have none."""

from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rislam_rt.adviser import forecast_codes, link_budget
from rislam_rt.adviser.link_budget import survey
from rislam_rt.cli.app import app
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.pipeline.room.late_paths import direct_path_warnings, late_path_warnings
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[3]
HALL, PAPER = (ROOT / "scenes" / name for name in ("large_hall", "paper_room"))
SHORT = ["channel=image_source", "cycles=3", "depth=1", 'schemes=["no_ris"]']


room_in = cache(load_scene)


@cache
def lines(room: Path, *changed: str) -> list[str]:
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))
    looked = survey(room_in(room), settings)
    return [finding.line for finding in late_path_warnings(looked.paths, looked.settings, "scene.toml")]


def advised(line: str) -> list[str]:
    """The settings that a warning asks for."""
    said = line.partition("; give ")[2].partition(" (")[0]
    return [part.replace(" = ", "=") for part in said.split(" and ")]


@pytest.mark.parametrize("changed", [(), ("receiver.num_subcarriers=128",), ("receiver.estimator=bound",)])
def test_a_hall_is_named_once_and_what_is_advised_mends_it(changed: tuple[str, ...]) -> None:
    (line,) = lines(HALL, *changed)
    assert line.startswith("scene.toml: receiver.max_delay: ")
    assert "after 80 ns (24 m of path)" in line
    assert "returns of 'wall" in line
    assert ("as if they were shorter" in line) == ("receiver.estimator=bound" not in changed)
    assert ("receiver.num_subcarriers=0" in advised(line)) == ("receiver.num_subcarriers=128" in changed)
    assert lines(HALL, *changed, *advised(line)) == []


def test_the_sounding_that_is_advised_repeats_after_all_that_is_heard() -> None:
    (line,) = lines(HALL)
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", advised(line)))
    looked = survey(room_in(HALL), settings)
    loud = looked.paths.valid & (settings.radio.integrated_snr(looked.paths.gain) >= settings.sensor.threshold)
    latest = float(looked.paths.tau[loud & (looked.paths.arrival[..., 2] >= 0.0)].max())
    assert latest <= settings.receiver.max_delay < settings.sensor.period
    assert f"repeats after {1e9 * settings.sensor.period:.0f} ns" in line
    assert f"{settings.receiver.max_delay / 80e-9:.2g} times as many false components" in line


def test_a_band_too_wide_for_any_sounding_is_told_to_come_nearer() -> None:
    wide = ("radio.carrier_ghz=1000", "radio.bandwidth_ghz=500", "radio.reference_snr_db=60")
    (line,) = lines(HALL, *wide)
    assert "lead the way nearer" in line


def test_a_small_room_has_none_and_a_short_window_makes_some() -> None:
    assert lines(PAPER) == []
    (line,) = lines(PAPER, "receiver.max_delay=20e-9")
    assert advised(line) != ["receiver.max_delay=2e-08"]


def test_a_run_says_what_check_said_of_late_paths() -> None:
    """The run hears the true motion over three cycles, so that its figures differ, not the setting that mends it."""
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [*SHORT, "receiver.max_delay=20e-9"])
    result = run_slam(load_scene(PAPER), spec, rng=np.random.default_rng(7))
    (line,) = result.warnings
    assert line.startswith("scene 'paper_room': receiver.max_delay: ")
    assert "after 20 ns" in line
    (mended,) = (setting for setting in advised(line) if "max_delay" in setting)
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [*SHORT, mended])
    assert run_slam(load_scene(PAPER), spec, rng=np.random.default_rng(7)).warnings == ()


def test_check_warns_of_them_and_counts_the_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_budget, "survey", partial(survey, places=1))
    monkeypatch.setattr(forecast_codes, "RANDOM_CODES", 2)
    shown = CliRunner().invoke(app, ["check", str(HALL)]).output
    assert shown.count("warning: ") == 2
    assert shown.count("receiver.max_delay: ") == 1
    assert "0 errors, 2 warnings" in shown
    small = CliRunner().invoke(app, ["check", str(ROOT / "scenes" / "empty_box")]).output
    assert "receiver.max_delay" not in small


@pytest.mark.parametrize(("offset", "drift", "first"), [(-0.4, 0.0, "0 s"), (0.0, -1.0, "0.4 s"), (0.1, -1.0, "0.5 s")])
def test_clocks_that_hide_the_direct_path_are_named_with_what_mends_it(offset: float, drift: float, first: str) -> None:
    """The direct path of 0.1 m takes 0.33 ns."""
    changed = (*SHORT, "cycles=20", f"told.clock_offset_ns={offset}", f"told.clock_drift_ns_s={drift}")
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed)
    setup = prepare_setup(room_in(PAPER), spec, rng=np.random.default_rng(1))
    time = setup.scene.agent.time
    (line,) = (finding.line for finding in direct_path_warnings(setup.paths, time, spec, "scene.toml"))
    assert line.startswith(f"scene.toml: receiver.min_delay: from {first} on the direct path comes in before 0 ns")
    mended = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", (*changed, *advised(line)))
    assert not list(direct_path_warnings(setup.paths, time, mended, "scene.toml"))


def test_a_direct_path_beyond_the_window_is_named_too() -> None:
    changed = (*SHORT, "cycles=20", "told.clock_drift_ns_s=100.0")
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed)
    setup = prepare_setup(room_in(PAPER), spec, rng=np.random.default_rng(1))
    (line,) = (f.line for f in direct_path_warnings(setup.paths, setup.scene.agent.time, spec, "scene.toml"))
    assert line.startswith("scene.toml: receiver.max_delay: from 0.8 s on the direct path comes in after 80 ns")
    mended = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", (*changed, "receiver.max_delay=2.8e-7"))
    assert "give receiver.max_delay = 2.8e-07" in line
    assert not list(direct_path_warnings(setup.paths, setup.scene.agent.time, mended, "scene.toml"))


def test_no_delay_is_advised_that_is_refused() -> None:
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", (*SHORT, "told.clock_offset_ns=-1100.0"))
    setup = prepare_setup(room_in(PAPER), spec, rng=np.random.default_rng(1))
    (line,) = (f.line for f in direct_path_warnings(setup.paths, setup.scene.agent.time, spec, "scene.toml"))
    assert line.endswith("; tell clocks less far apart")


@pytest.mark.parametrize("told", ["clock_offset_ns=-0.3", "clock_drift_ns_s=0.1", "tilt_deg=1.0"])
def test_a_direct_path_that_is_heard_is_not_warned_of(told: str) -> None:
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", (*SHORT, f"told.{told}"))
    setup = prepare_setup(room_in(PAPER), spec, rng=np.random.default_rng(1))
    assert not list(direct_path_warnings(setup.paths, setup.scene.agent.time, spec, "scene.toml"))


@pytest.mark.parametrize(
    ("estimator", "most", "scheme"),
    [
        *(("bound", 5e-5, scheme) for scheme in ("optimized", "bp_slam_aoa", "channel_slam")),
        ("waveform", 1e-3, "optimized"),
        *(pytest.param("waveform", 1e-3, one, marks=pytest.mark.slow) for one in ("bp_slam_aoa", "channel_slam")),
    ],
)
def test_clocks_apart_cost_no_estimator_anything(scheme: str, estimator: str, most: float) -> None:
    """Lengths counted from the direct path, whichever clock is ahead: the same estimates but for its error of 7 um in
    each cycle, and, from samples, for noise that falls on other delays: a tenth of the components' millimetres."""
    plain = ["channel=image_source", "cycles=12", f'schemes=["{scheme}"]', f"receiver.estimator={estimator}"]
    apart = "told.clock_offset_ns=-2.0", "told.clock_drift_ns_s=-1.0", "receiver.min_delay=-1e-8"
    found = [
        run_slam(
            room_in(PAPER),
            load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [*plain, *more]),
            rng=np.random.default_rng(3),
        )
        for more in ((apart[2],), apart)
    ]
    one, other = (each.schemes[scheme].position for each in found)
    assert np.abs(one - other).max() < most
