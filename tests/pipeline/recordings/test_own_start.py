"""The start of one's own measurements on the command line: heading, and what a file brings by itself."""

from pathlib import Path

import numpy as np
import pytest

import rislam_rt
from rislam_rt.cli.slam import _prior, command
from rislam_rt.errors import ConfigError
from rislam_rt.scene.motion.recorded_poses import MAX_HEADING
from rislam_rt.shipped import find_pipeline
from rislam_rt.slam import StartPrior
from rislam_rt.slam.start_prior import heading_from_velocity
from rislam_rt.studies.unseen import Inputs

FREE = ["slam.heading=estimated"]
BODY = {"tx": "0.05,0,0", "rx": "-0.05,0,0"}
Given = dict[str, object]


@pytest.fixture
def given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Given:
    """Inputs that the filter was given by the command: a file of one component without a compass, in a new folder."""
    seen: Given = {}

    def watched(inputs: Inputs, *rest: object, **named: object) -> object:
        seen["inputs"] = inputs
        return rislam_rt.localise(inputs, *rest, **named)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rislam_rt.pipeline.recordings.own_measurements.localise", watched)
    Path("free.csv").write_text("time_s,delay_s,cos_x,cos_y,snr_db\n0,6e-9,0.1,0.1,30\n")
    Path("compass.csv").write_text("time_s,heading_rad,delay_s,cos_x,cos_y,snr_db\n0,0.4,6e-9,0.1,0.1,30\n")
    return seen


def slam(file: str, *settings: str, out: str = "out", **options: str) -> None:
    """`rislam-rt slam FILE --start 1,1,1 ...` with Tx and Rx."""
    pipeline, words = find_pipeline("trace_then_slam"), {**BODY, **options}
    command(Path(file), pipeline, [*FREE, *settings], start="1,1,1", out=Path(out), **words)


def started(given: Given) -> StartPrior:
    """Start prior that the filter got."""
    inputs = given["inputs"]
    assert isinstance(inputs, Inputs)
    return inputs.start


def test_a_heading_from_the_velocity_is_as_well_known_as_that_is(given: Given) -> None:
    """0.01 m/s across 0.2 m/s: 2.9 degrees. It was taken for exact; half of what is known is each one's."""
    slam("free.csv", velocity="0.12,0.16,0")
    start = started(given)
    assert start.heading == pytest.approx(np.arctan2(0.16, 0.12))
    assert start.heading_std == pytest.approx(np.sqrt(2.0) * np.arctan(0.01 / 0.2))
    assert start.velocity_std == pytest.approx(np.sqrt(2.0) * 0.01)
    slam("free.csv", "start.heading_std_deg=5", "start.velocity_std_m_s=0.04", velocity="0.12,0.16,0", out="2")
    assert started(given).heading_std == pytest.approx(np.hypot(np.deg2rad(5.0), np.sqrt(2.0) * np.arctan(0.2)))


def test_heading_and_velocity_together_know_the_turn_as_drawn_velocities_do() -> None:
    draws = np.array([0.4, -0.3]) + 0.02 * np.random.default_rng(0).standard_normal((100_000, 2))
    off = np.arctan2(draws[:, 1], draws[:, 0]) - np.arctan2(-0.3, 0.4)
    start = heading_from_velocity(StartPrior(np.zeros(3), np.array([0.4, -0.3, 0.0]), 0.0, velocity_std=0.02))
    by_velocity, by_heading = np.arctan(start.velocity_std / 0.5), start.heading_std
    assert (by_velocity**-2 + by_heading**-2) ** -0.5 == pytest.approx(off.std(), rel=0.01)  # of 1e5 draws: 0.2 %
    assert start.heading == pytest.approx(np.arctan2(-0.3, 0.4))


@pytest.mark.parametrize("heading", [45.0, -30.0, np.nan])
def test_a_heading_in_degrees_is_refused_where_radians_are_wanted(heading: float) -> None:
    with pytest.raises(ConfigError, match=rf"^start\.heading: {heading:g} rad received; give radians, not degrees"):
        StartPrior(np.zeros(3), np.zeros(3), heading)


def test_a_heading_of_three_turns_as_a_recording_may_have_is_taken() -> None:
    assert StartPrior(np.zeros(3), np.zeros(3), MAX_HEADING + 1.0).heading == MAX_HEADING + 1.0


def test_a_heading_that_is_given_counts_and_is_as_exact_as_is_said(given: Given) -> None:
    slam("free.csv", velocity="0.12,0.16,0", heading="-30")
    assert started(given).heading == pytest.approx(np.deg2rad(-30.0))
    assert started(given).heading_std == 0.0
    slam("free.csv", "start.heading_std_deg=5", heading="-30", out="2")  # at rest
    assert started(given).heading_std == pytest.approx(np.deg2rad(5.0))


def test_with_a_compass_the_start_is_the_compass_s(given: Given) -> None:
    for settings in ((), ("slam.heading=known",)):
        slam("compass.csv", *settings, out=f"out{len(settings)}")  # at rest
        assert (started(given).heading, started(given).heading_std) == (0.4, 0.0)
    with pytest.raises(ConfigError, match=r"^--heading: compass.csv has a compass"):
        slam("compass.csv", heading="20")


@pytest.mark.parametrize("options", [{}, {"velocity": "0,0,1"}, {"velocity": "0.005,0.005,0"}])
def test_without_a_direction_the_heading_is_asked_for(given: Given, options: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=r"has no direction; give --heading DEG$"):
        slam("free.csv", **options)
    assert not given


@pytest.mark.parametrize("text", ["north", "nan", "361", "1_0", ""])
def test_a_heading_that_is_none_is_one_line(text: str) -> None:
    with pytest.raises(ConfigError, match=f"^--heading: '{text}' received; give degrees from -360 to 360$"):
        _prior("1,1,1", "0,0,0", (0.01, 0.01, 0.0), text)


def test_what_a_netcdf_file_brings_is_not_given_twice() -> None:
    """It was passed over in silence."""
    with pytest.raises(ConfigError, match=r"^--start, --tx, --rx: mine.nc brings its own start, Tx and Rx"):
        slam("mine.nc")


def test_a_table_is_not_given_a_body_that_nobody_told(given: Given) -> None:
    """The paper's baseline, turned by 0.5 rad, was assumed: 5.6 cm of error at 1 cm claimed with one along x."""
    with pytest.raises(ConfigError, match=r"^compass.csv: .* where Tx and Rx sit .*; give --tx X,Y,Z and --rx X,Y,Z"):
        command(Path("compass.csv"), find_pipeline("trace_then_slam"), FREE, start="1,1,1")
    assert not given
    slam("compass.csv")
    inputs = given["inputs"]
    assert isinstance(inputs, Inputs)
    assert (inputs.body.tx_offset.tolist(), inputs.body.rx_offset.tolist()) == ([0.05, 0.0, 0.0], [-0.05, 0.0, 0.0])


def test_the_page_and_the_docstrings_say_the_default_body_in_numbers() -> None:
    x, y, z = rislam_rt.Body().rx_offset
    assert rislam_rt.Body().tx_offset.tolist() == [-x, -y, -z]
    said = f"Rx at ({x:.4f}, {y:.4f}, {z:g})"
    page = (Path(__file__).parents[3] / "docs" / "own_measurements.md").read_text()
    for text in (page, rislam_rt.inputs_of.__doc__, rislam_rt.Body.__doc__):
        assert said in text


def test_the_help_says_how_well_the_heading_is_known() -> None:
    said = " ".join(str(command.__doc__).split())
    for words in ("start.heading_std_deg", "taken from --velocity", "slam.heading=estimated"):
        assert words in said
