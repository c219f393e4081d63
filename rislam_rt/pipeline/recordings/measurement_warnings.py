"""Warnings of a user's own measurements: what is allowed, and most often a mistake."""

from collections.abc import Iterator

import numpy as np

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.pipeline.cycle import usual_step
from rislam_rt.pipeline.estimators import use_directions
from rislam_rt.pipeline.recordings.inputs import PARTS, Inputs
from rislam_rt.pipeline.recordings.own_measurements import LONGEST_STEP
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.slam.observations import ASIDE

EARLY = 0.05
"""Part of the way from Tx to Rx by which a path may be shorter without a warning: tape measures err by so much."""
SHORTEST_STEP = 1e-3
"""[s] Median time between cycles of one component each below which the times are warned of: each row has its own."""


def input_warnings(inputs: Inputs, spec: PipelineSpec) -> list[str]:
    """Lines about a user's own measurements that are allowed, and most often a mistake: times in another unit, each
    component with a time of its own, components that are there twice, too weak for the receiver or too early, and a
    direct path that comes from elsewhere than the Tx."""
    step = usual_step(inputs.time)
    counts, lines, row = {len(one) for one in inputs.measurements}, [], 0
    copies: list[str] = []
    if step > LONGEST_STEP:
        lines.append(f"time_s: cycles are {step:g} s apart; give seconds, if these were milliseconds")
    if counts == {1} and 0.0 < step < SHORTEST_STEP:
        lines.append(
            f"time_s: every cycle holds one component, {step:g} s apart; rows of one time are one cycle: round them"
        )
    for time, one in zip(inputs.time + inputs.since, inputs.measurements, strict=True):
        seen: set[bytes] = set()  # noise never draws two that are alike
        for number, values in enumerate(np.column_stack([getattr(one, name) for name in PARTS])):
            if values.tobytes() in seen:
                copies.append(f"row {row + number + 1} of the data, at {time:.10g} s")
            seen.add(values.tobytes())
        row += max(len(one), 1)  # a cycle in which nothing was heard is a row, too
    if copies:
        what = "component is an exact copy" if len(copies) == 1 else "components are exact copies"
        lines.append(f"{len(copies)} {what} of another in the same cycle, the first in {copies[0]}; leave copies out")
    return [*lines, *_weak_components(inputs, spec), *_early_paths(inputs), *_direct_paths(inputs, spec)]


def _weak_components(inputs: Inputs, spec: PipelineSpec) -> Iterator[str]:
    """Line about a user's own measurements of which most components are too weak for their receiver to report them."""
    settings = build_settings(spec)
    snr = np.concatenate([settings.radio.integrated_snr(one.amplitude) for one in inputs.measurements])
    weak = int(np.count_nonzero(snr < settings.sensor.threshold))
    if weak > 0.5 * len(snr):
        decibels = 10.0 * np.log10([float(np.median(snr)), settings.sensor.threshold])
        yield (
            f"amplitude or snr_db: {weak} of {len(snr)} components are below the detection threshold of "
            f"{decibels[1]:.3g} dB, the middle one at {decibels[0]:.3g} dB, and the filter takes few for landmarks, or "
            "none; give the modulus of the gain, not power, and the radio's energy, noise_psd and array"
        )


def _early_paths(inputs: Inputs) -> Iterator[str]:
    """Line about a user's own measurements whose shortest path is mostly shorter than from Tx to Rx, by more than it
    errs: no path is, by clocks that agree."""
    baseline, cycles, early = float(np.linalg.norm(inputs.body.tx_offset - inputs.body.rx_offset)), 0, []
    for one in inputs.measurements:
        if len(one):
            cycles, first = cycles + 1, int(np.argmin(one.tau))
            length, error = SPEED_OF_LIGHT * one.tau[first], SPEED_OF_LIGHT * one.tau_std[first]
            early += [float(length)] if length + 5.0 * error < (1.0 - EARLY) * baseline else []
    if len(early) > 0.5 * cycles:
        yield (
            f"delay_s: in {len(early)} of {cycles} cycles the shortest path ({np.median(early):.3g} m) is shorter than "
            f"from Tx to Rx ({baseline:.3g} m), which is taken for clocks that are apart, if at all; give delays "
            "of the whole way, not halves or from the first path on, and Tx and Rx where they are"
        )


def _direct_paths(inputs: Inputs, spec: PipelineSpec) -> Iterator[str]:
    """Line about a user's own measurements whose direct path mostly arrives from elsewhere than where the Tx is, with
    the cause if another body frame explains it: the filter would take either for what it is told.

    A path as long as from Tx to Rx, by `EARLY` and five of its own deviations, is the direct one if these are less than
    half of that: else a near wall's may be. The array hears directions whole periods apart alike.
    """
    span = inputs.body.tx_offset - inputs.body.rx_offset
    baseline, period = float(np.linalg.norm(span)), 1.0 / build_settings(spec).radio.array.spacing
    if not baseline or not use_directions(spec.schemes[:1]):
        return
    found = []
    for one in inputs.measurements:
        off, doubt = np.abs(SPEED_OF_LIGHT * one.tau - baseline), 5.0 * SPEED_OF_LIGHT * one.tau_std
        direct = (off < EARLY * baseline + doubt) & (doubt < 0.5 * baseline)
        near = np.flatnonzero(direct & (one.cosines_std.max(axis=-1) < ASIDE / 2.0))
        found += [one.cosines[near[np.argmax(one.amplitude[near])]]] if len(near) else []
    if 2 * len(found) < len(inputs.measurements):
        return
    heard, there = np.array(found), span[:2] / baseline
    frames = {
        "as told": there,
        "exchange Tx and Rx": -there,
        "take cos_y with the other sign, y is to the left": there * [1.0, -1.0],
        "exchange cos_x and cos_y, x is forward and y to the left": there[::-1],
    }
    aside = heard - np.array(list(frames.values()))[:, None]
    aside -= np.round(aside / period) * period
    fits = np.median(np.abs(aside).max(axis=-1), axis=-1) < ASIDE
    if fits[0]:
        return
    elsewhere = "give Tx and Rx where they are, and directions in the axes of the body: x forward, y to the left"
    mend = list(frames)[int(fits.argmax())] if fits.any() else elsewhere
    middle = np.median(heard, axis=0)
    yield (
        f"cos_x, cos_y: the direct path, in {len(found)} of {len(inputs.measurements)} cycles, arrives from "
        f"({middle[0]:.3g}, {middle[1]:.3g}), and Tx lies at ({there[0]:.3g}, {there[1]:.3g}) from Rx; {mend}"
    )
