"""Warnings of one's own measurements: units, weak and doubled components, and a body frame that contradicts them."""

import re

import numpy as np
import pytest

from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.recordings.measurement_warnings import input_warnings
from rislam_rt.pipeline.recordings.own_measurements import inputs_of
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.shipped import find_pipeline
from rislam_rt.slam import StartPrior
from rislam_rt.studies.unseen import Inputs

CYCLES = 20
CHANGES = [f"cycles={CYCLES}", "channel=image_source", "depth=1", "schemes=['no_ris']", "slam.use_vt=true",
           "receiver.estimator=bound"]  # fmt: skip
Table = dict[str, list[float]]


@pytest.mark.parametrize(
    ("factor", "apart", "said"),
    [
        (1000.0, 0.0, "cycles are 100 s apart; give seconds"),
        (1.0, 1e-6, "every cycle holds one component, 1e-06 s apart"),
    ],
)
def test_times_that_are_most_often_a_mistake_are_warned_of(
    table: Table, spec: PipelineSpec, factor: float, apart: float, said: str
) -> None:
    times = [factor * time + apart * row for row, time in enumerate(table["time_s"])]
    start, radio = StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio)
    assert not input_warnings(inputs_of(table, start, radio), spec)
    (line,) = input_warnings(inputs_of({**table, "time_s": times}, start, radio), spec)
    assert said in line


def test_components_too_weak_for_the_receiver_are_warned_of(
    recorded: tuple[Inputs, np.ndarray], table: Table, spec: PipelineSpec
) -> None:
    """Power given for amplitude; a noise density of a thousand times what it is."""
    radio, start, rows = build_radio(spec.radio), recorded[0].start, len(table["time_s"])
    power = {**table, "amplitude": [value**2 for value in table["amplitude"]]}
    (line,) = input_warnings(inputs_of(power, start, radio), spec)
    found = re.match(
        rf"amplitude or snr_db: (\d+) of {rows} components are below the detection threshold of 10 dB", line
    )
    assert found
    assert int(found[1]) > 0.9 * rows
    noisy = load_spec(find_pipeline("trace_then_slam"), [*CHANGES, "radio.noise_psd=1.0"])
    (line,) = input_warnings(inputs_of(table, start, build_radio(noisy.radio)), noisy)
    assert line.startswith(f"amplitude or snr_db: {rows} of {rows} components")


def test_a_direct_path_shorter_than_from_tx_to_rx_is_warned_of(
    recorded: tuple[Inputs, np.ndarray], table: Table, spec: PipelineSpec
) -> None:
    """Half delays, or a Tx said to be farther off than it is; an error of five per cent of the baseline passes."""
    radio, (inputs, _) = build_radio(spec.radio), recorded
    baseline = np.linalg.norm(inputs.body.tx_offset - inputs.body.rx_offset)

    def said(part: float) -> list[str]:
        delays = [part * delay for delay in table["delay_s"]]
        return input_warnings(inputs_of({**table, "delay_s": delays}, inputs.start, radio, inputs.body), spec)

    assert said(0.96) == []
    (line,) = said(0.5)
    assert line.startswith(
        f"delay_s: in {CYCLES} of {CYCLES} cycles the shortest path ({baseline / 2:.3g} m) is shorter"
    )


def test_rows_that_are_there_twice_are_warned_of(
    recorded: tuple[Inputs, np.ndarray], table: Table, spec: PipelineSpec
) -> None:
    radio, start = build_radio(spec.radio), recorded[0].start
    count = len(table["time_s"])
    late = [*range(count), count - 2, count - 1]  # two of the last cycle
    doubled = [row for row in range(count) for _ in range(2)]
    for rows, said in (
        (doubled, f"{count} components are exact copies of another in the same cycle, the first in row 2 of the data"),
        (late, f"2 components are exact copies of another in the same cycle, the first in row {count + 1} of the data"),
    ):
        given = {name: [column[row] for row in rows] for name, column in table.items()}
        (line,) = input_warnings(inputs_of(given, start, radio), spec)
        assert line.startswith(said)
    silent = {name: [np.nan, *column] for name, column in table.items()}  # a first cycle without a component
    silent["time_s"][0], silent["heading_rad"][0] = -1.0, 0.0
    again = {name: [*column[:2], column[1], *column[2:]] for name, column in silent.items()}
    (line,) = input_warnings(inputs_of(again, start, radio), spec)
    assert line.startswith("1 component is an exact copy of another in the same cycle, the first in row 3 of the data")


@pytest.mark.parametrize(
    ("turn", "said"),
    [
        ([[1.0, 0.0], [0.0, 1.0]], None),
        ([[1.0, 0.0], [0.0, -1.0]], "take cos_y with the other sign, y is to the left"),
        ([[-1.0, 0.0], [0.0, -1.0]], "exchange Tx and Rx"),
        ([[0.0, 1.0], [1.0, 0.0]], "exchange cos_x and cos_y, x is forward and y to the left"),
        ([[0.8, 0.6], [-0.6, 0.8]], "give Tx and Rx where they are, and directions in the axes of the body"),
    ],
)
def test_a_direct_path_from_elsewhere_than_the_tx_is_warned_of(
    recorded: tuple[Inputs, np.ndarray], table: Table, spec: PipelineSpec, turn: list[list[float]],
    said: str | None,
) -> None:  # fmt: skip
    """The paper's agent has its Tx behind and to the right of its Rx: each other frame puts it somewhere else.

    A filter that is told the wrong one says that all is well, and draws a mirrored map.
    """
    radio, (inputs, _) = build_radio(spec.radio), recorded
    span = inputs.body.tx_offset - inputs.body.rx_offset
    length = np.linalg.norm(span)
    first = np.unique(table["time_s"], return_index=True)[1]
    given = {name: list(column) for name, column in table.items()}
    for row in first:  # a cycle of the table has the direct path first
        given["delay_s"][row], given["amplitude"][row] = length / 299792458.0, 1.0
        given["cos_x"][row], given["cos_y"][row] = np.array(turn) @ span[:2] / length
        given["cos_x_std"][row] = given["cos_y_std"][row] = 1e-4
    lines = input_warnings(inputs_of(given, inputs.start, radio, inputs.body), spec)
    if said is None:
        assert lines == []
        return
    (line,) = lines
    assert line.startswith(f"cos_x, cos_y: the direct path, in {CYCLES} of {CYCLES} cycles, arrives from (")
    assert line.endswith(said) or f"; {said}" in line
    # where no length is known to less than the baseline, the loudest near path may be anything
    vague = {**given, "delay_std_s": [length / 299792458.0] * len(given["delay_s"])}
    assert input_warnings(inputs_of(vague, inputs.start, radio, inputs.body), spec) == []
