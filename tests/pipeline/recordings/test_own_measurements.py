"""Measurements of one's own: the same answer as in the run they came from, and a clear line for a wrong unit."""

import csv
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rislam_rt
from rislam_rt.cli.options import parse_point
from rislam_rt.cli.slam import _body, _new_folder, _prior, command
from rislam_rt.errors import ConfigError
from rislam_rt.measurement import ReceiverConfig, build_sensor
from rislam_rt.model import SensorModel
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.recordings.answer_files import true_positions
from rislam_rt.pipeline.recordings.own_measurements import inputs_of, localise, read_inputs
from rislam_rt.pipeline.recordings.replay import replay
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.scene.write import tum_bytes
from rislam_rt.shipped import find_pipeline, find_room
from rislam_rt.slam import StartPrior
from rislam_rt.studies.unseen import Inputs

CYCLES = 20
CHANGES = [f"cycles={CYCLES}", "channel=image_source", "depth=1", "schemes=['no_ris']", "slam.use_vt=true",
           "receiver.estimator=bound"]  # fmt: skip
BODY = {"tx": "-0.0439,-0.024,0", "rx": "0.0439,0.024,0"}
Table = dict[str, list[float]]


def write_csv(file: Path, table: Table, rows: int | None = None) -> Path:
    """The table, or its first rows, as a CSV file."""
    with file.open("w", newline="") as lines:
        writer = csv.writer(lines)
        writer.writerow(table)
        writer.writerows(list(zip(*table.values(), strict=True))[:rows])
    return file


def point(value: np.ndarray) -> str:
    """Three coordinates for the command line, to the last digit."""
    return ",".join(map(repr, map(float, value)))


def test_from_a_file_comes_the_answer_of_the_run(
    recorded: tuple[Inputs, np.ndarray], table: Table, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    inputs, position = recorded
    file, poses = write_csv(tmp_path / "mine.csv", table), tmp_path / "true.tum"
    true = rislam_rt.load_scene("paper_room").agent[:CYCLES]
    poses.write_bytes(tum_bytes(true.time, true.position, true.heading))
    start, pipeline = point(inputs.start.position), find_pipeline("trace_then_slam")
    command(
        file, pipeline, set_=CHANGES, start=start, velocity=point(inputs.start.velocity),
        tx=point(inputs.body.tx_offset), rx=point(inputs.body.rx_offset), truth=poses, out=tmp_path / "out",
        json=tmp_path / "said.json",
    )  # fmt: skip
    said = capsys.readouterr().out
    assert said.startswith(f"scheme: no_ris\ncycles: {CYCLES}\n")
    about = json.loads((tmp_path / "out" / "about.json").read_text())
    assert about["input"] == {"file": "mine.csv", "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    assert (about["scheme"], about["config"]["cycles"]) == ("no_ris", CYCLES)
    np.testing.assert_array_equal(about["body"]["tx_m"], inputs.body.tx_offset)
    np.testing.assert_array_equal(about["start"]["velocity"], inputs.start.velocity)
    assert about["versions"]["rislam-rt"] == rislam_rt.__version__
    assert "rmse_m: " in said
    with (tmp_path / "out" / "estimate.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    found = np.array([[float(row[name]) for name in ("x_m", "y_m", "z_m")] for row in rows])
    # nine digits in the file; the run's own deviations pass through the table unrounded
    np.testing.assert_allclose(found, position, rtol=1e-8)
    # where it began is told to 0.01 m an axis, and nothing measured says it any better
    std = np.array([[float(row[name]) for name in ("std_x_m", "std_y_m")] for row in rows])
    assert std.min() > 0.01 * (1.0 - 1e-6)
    with pytest.raises(ConfigError, match="not empty; give a new folder"):
        command(file, pipeline, set_=CHANGES, start=start, **BODY, out=tmp_path / "out")


def test_snr_and_angles_say_the_same_as_amplitudes_and_cosines(
    recorded: tuple[Inputs, np.ndarray], table: Table, spec: PipelineSpec
) -> None:
    inputs, _ = recorded
    radio, body = build_radio(spec.radio), inputs.body
    x, y = np.array(table["cos_x"]), np.array(table["cos_y"])
    inside = np.hypot(x, y) < 1.0
    rows = {name: np.array(column)[inside] for name, column in table.items()}
    plain = inputs_of(rows, inputs.start, radio, body)
    other = {name: rows[name] for name in ("time_s", "heading_rad", "delay_s", "delay_std_s", "cos_x_std", "cos_y_std")}
    other["theta_r_rad"], other["phi_r_rad"] = np.arcsin(np.hypot(x, y)[inside]), np.arctan2(y, x)[inside]
    other["snr_db"] = 10.0 * np.log10(radio.integrated_snr(rows["amplitude"]))
    again = inputs_of(other, inputs.start, radio, body)
    for one, two in zip(plain.measurements, again.measurements, strict=True):
        np.testing.assert_allclose(two.cosines, one.cosines, atol=1e-12)
        np.testing.assert_allclose(two.amplitude, one.amplitude, rtol=1e-12)


def test_a_cycle_in_which_nothing_is_heard_counts(table: Table, spec: PipelineSpec) -> None:
    start = StartPrior(np.zeros(3), np.zeros(3), 0.0)
    rows = {name: [*column, np.nan] for name, column in table.items()}
    rows["time_s"][-1], rows["heading_rad"][-1] = 99.0, 0.0
    inputs = inputs_of(rows, start, build_radio(spec.radio))
    assert len(inputs.measurements) == CYCLES + 1
    assert len(inputs.measurements[-1]) == 0
    assert len(localise(inputs, spec, rng=np.random.default_rng(0)).estimates) == CYCLES + 1


def test_the_filter_reckons_with_as_many_captures_as_the_recording_had(recorded: tuple[Inputs, np.ndarray]) -> None:
    """Each capture has false components of its own: the codes' sum, and a difference for every panel told apart."""
    spec = load_spec(find_pipeline("trace_then_slam"), [*CHANGES, "receiver.estimator=waveform"])
    inputs, panels = recorded[0], rislam_rt.load_scene(find_room("two_panels")).ris.spec
    told = tuple(replace(one, from_panel=np.zeros(len(one))) for one in inputs.measurements)

    def rate(given: Inputs) -> float:
        begun: list[SensorModel] = []
        deaf = ESTIMATORS["slam"]._replace(
            init=lambda start, body, panel, sensor, config, *, rng: begun.append(sensor),
            step=lambda *_, **__: (None, None),
            estimate=lambda *_: None,
        )
        replay(given, spec.model_dump(), "random", estimator=deaf, rng=np.random.default_rng(0))
        return begun[0].false_alarms

    assert spec.receiver.alternation
    one = rate(inputs)
    assert one == build_sensor(build_radio(spec.radio), ReceiverConfig(alternation=False)).false_alarms
    assert rate(inputs._replace(panel=panels)) == one
    assert rate(inputs._replace(measurements=told)) == pytest.approx(2.0 * one)
    assert rate(inputs._replace(measurements=told, panel=panels)) == pytest.approx(3.0 * one)


def test_without_a_compass_the_heading_has_to_be_estimated(table: Table, spec: PipelineSpec) -> None:
    """Zeros in its stead would be taken for a compass that shows them: nothing is taken for known that nothing told."""
    rows = {name: column for name, column in table.items() if name != "heading_rad"}
    inputs = inputs_of(rows, StartPrior(np.zeros(3), np.zeros(3), 0.3), build_radio(spec.radio))
    with pytest.raises(ConfigError, match=r"^mine\.csv: heading_rad: no such column"):
        localise(inputs, spec, rng=np.random.default_rng(0), place="mine.csv")
    free = spec.model_copy(update={"slam": spec.slam.model_copy(update={"heading": "estimated"})})
    answers = localise(inputs, free, rng=np.random.default_rng(0))
    assert answers.estimates[0].heading == pytest.approx(0.3, abs=1e-12)


def test_the_noise_of_the_command_line_goes_before_the_snr_of_the_file() -> None:
    spec = load_spec(find_pipeline("trace_then_slam"), ["radio.noise_psd=3.5e-11"])
    assert build_radio(spec.radio).noise_psd == 3.5e-11
    with pytest.raises(ConfigError, match="not both"):
        load_spec(find_pipeline("trace_then_slam"), ["radio.noise_psd=3.5e-11", "radio.reference_snr_db=3"])


def test_a_folder_by_another_name_is_not_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "map.json").write_text("mine")
    monkeypatch.chdir(tmp_path)
    for folder in ("missing/..", "x" * 300):
        with pytest.raises(ConfigError, match="--out"):
            _new_folder(Path(folder))


def test_a_folder_that_another_command_filled_meanwhile_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.csv").write_text("time_s,heading_rad,delay_s,cos_x,cos_y,snr_db\n0,0,6e-9,0.1,0.1,30\n")
    out = tmp_path / "out"

    def slow(*given: object, **named: object) -> object:
        out.mkdir()
        (out / "map.json").write_text("theirs")
        return localise(*given, **named)

    monkeypatch.setattr("rislam_rt.pipeline.recordings.own_measurements.localise", slow)
    with pytest.raises(ConfigError, match="exists and is not empty"):
        command(tmp_path / "mine.csv", find_pipeline("trace_then_slam"), set_=CHANGES, start="1,1,1", **BODY, out=out)
    assert (out / "map.json").read_text() == "theirs"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("missing.csv", "no such file; give a CSV or NetCDF file"),
        ("missing.nc", "no such file; give one as a run folder's"),
        ("damaged.nc", "not a readable NetCDF file; give one as a run folder's"),
        ("mine.csv", "give --start X,Y,Z"),
    ],
)
def test_a_wrong_file_is_told_before_a_missing_start(tmp_path: Path, spec: PipelineSpec, name: str, said: str) -> None:
    for there in ("damaged.nc", "mine.csv"):
        (tmp_path / there).write_text("time_s,delay_s,cos_x,cos_y,snr_db\n0,6e-9,0.1,0.1,30\n")
    with pytest.raises(ConfigError, match=said):
        read_inputs(tmp_path / name, None, build_radio(spec.radio))


def test_a_delay_at_the_edge_of_the_window_passes(table: Table, spec: PipelineSpec) -> None:
    """0 s, as our own receiver reports a false component at times: the file of a run is not refused for it."""
    rows = {**table, "delay_s": [0.0] * len(table["time_s"])}
    given = inputs_of(rows, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))
    assert max(one.tau.max(initial=0.0) for one in given.measurements) == 0.0


def test_a_start_told_wrong_is_said_where_nobody_knows_the_truth(
    table: Table, recorded: tuple[Inputs, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A speed wrong by 1 m/s, in a second's measurements: on the screen and in the table of cycles; told right, not."""
    inputs, _ = recorded
    file = write_csv(tmp_path / "mine.csv", table, sum(time < inputs.time[10] for time in table["time_s"]))
    for off in (0.0, 1.0):
        command(
            file, find_pipeline("trace_then_slam"), set_=CHANGES, start=point(inputs.start.position),
            velocity=point(inputs.start.velocity + off * np.eye(3)[0]), tx=point(inputs.body.tx_offset),
            rx=point(inputs.body.rx_offset), out=tmp_path / f"out{off}",
        )  # fmt: skip
        with (tmp_path / f"out{off}" / "estimate.csv").open() as lines:
            said = [row["outcome"] for row in csv.DictReader(lines)].count("diverged")
        assert (said > 0) == (off > 0.0)
        shown = capsys.readouterr().out
        assert f"cycles_diverged: {said}\n" in shown
        assert ("lost_because: the first paths tell of another speed" in shown) == (off > 0.0)


def test_the_estimate_has_the_times_of_the_file(
    table: Table, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a clock that counts from the epoch, as a recording's: other logs are joined by it."""
    rows = {**table, "time_s": [1.7e9 + time for time in table["time_s"]]}
    file = write_csv(tmp_path / "mine.csv", rows, 60)
    command(file, find_pipeline("trace_then_slam"), set_=CHANGES, start="1,1,1", **BODY, out=tmp_path / "out")
    with (tmp_path / "out" / "estimate.csv").open() as lines:
        times = [float(row["time_s"]) for row in csv.DictReader(lines)]
    assert len(times) > 1
    np.testing.assert_allclose(times, np.unique(rows["time_s"][:60]), rtol=0.0, atol=1e-6)
    track = np.loadtxt(tmp_path / "out" / "estimate.tum")
    np.testing.assert_allclose(track[:, 0], times, rtol=0.0, atol=1e-6)
    assert "warning" not in capsys.readouterr().err


def test_times_in_which_the_agent_would_cross_rooms_are_refused(table: Table, spec: PipelineSpec) -> None:
    """Milliseconds for seconds at 0.1 m/s: 10 m a cycle. Who stands still may be sounded at any interval."""
    radio = build_radio(spec.radio)
    for factor, speed, refused in ((1e3, 0.1, True), (1e6, 0.1, True), (1e3, 0.0, False), (1.0, 9.0, False)):
        rows = {**table, "time_s": [factor * time for time in table["time_s"]]}
        start = StartPrior(np.zeros(3), np.array([0.6 * speed, 0.8 * speed, 0.0]), 0.0)
        if not refused:
            inputs_of(rows, start, radio)
            continue
        with pytest.raises(
            ConfigError, match=r"time_s: cycles are 1e?0+5? s apart, in which an agent at 0\.1 m/s goes"
        ):
            inputs_of(rows, start, radio)


def test_a_start_that_is_too_far_is_told_so() -> None:
    """UTM coordinates are three numbers: the line must not say that they are not."""
    with pytest.raises(ConfigError, match=r"--start: '500000,5400000,100' received; give at most 100000"):
        parse_point("--start", "500000,5400000,100")
    with pytest.raises(ConfigError, match="give three numbers"):
        parse_point("--start", "1,2,nan")


def test_the_pages_example_in_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "own_measurements.md").read_text()
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(block, {})
    assert capsys.readouterr().out.startswith("SlamEstimate: at (0.50")


def test_true_poses_may_be_a_csv_file(tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text("time,x_mm,y_mm,z_mm\n0,1000,2000,500\n0.1,1010,2000,500\n")
    assert true_positions(tmp_path / "poses.csv", np.array([0.0, 0.1])).tolist() == [[1.0, 2.0, 0.5], [1.01, 2.0, 0.5]]
    with pytest.raises(ConfigError, match="pose 0 is at 0 s, its cycle at 1000 s, more than half a cycle apart"):
        true_positions(tmp_path / "poses.csv", np.array([1000.0, 1000.1]))


def test_a_start_or_a_body_in_millimetres_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    stds = (0.01, 0.01, 0.0)
    _prior("1,1,0.5", "0.3,0.4,0", stds)
    _body("0.05,0,0", "-0.05,0,0")
    assert not capsys.readouterr().err
    _prior("1,1,0.5", "300,400,0", stds)
    _body("50,0,0", "-0.05,0,0")
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "warning: --velocity: 500 m/s; give metres a second"
    assert said[1] == "warning: --tx: 50 m from the agent's position; give metres"
