"""Does the window filter hang on a constant? Each at half and at twice its value, over recorded rooms.

Probabilities have their odds halved and doubled. Every constant of `slam.model_constants` is changed by itself,
and the same recorded measurements are filtered again. The table says by how much the median error relative to the start
changes, and, as a median over a dozen rooms jitters by more than most constants do, the spread of the change room by
room. The first line says what chance alone does: the same constants, delays moved by a billionth of a deviation.
Record first: a pipeline of kind `unseen` with `save = "components"` (see docs/results/unseen.md). Run with
one thread of linear algebra (OPENBLAS_NUM_THREADS=1): `python benchmarks/filter/constants.py RECORDINGS --rooms 12`.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import rislam_rt.slam.window  # noqa: F401  every module that reads the table
from rislam_rt import read_recording, replay
from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS, ModelConstants

PROBABILITIES = ("rare", "cleared", "shown", "square", "upright", "born", "company")
"""Constants whose odds are halved and doubled."""
NUDGE = 1e-9
"""Reported deviations by which chance moves a measurement: next to nothing, but it decides what was undecided."""


def changed(name: str, factor: float) -> ModelConstants:
    """The table with one constant at another value."""
    value = getattr(CONSTANTS, name)
    if name in PROBABILITIES:
        odds = factor * value / (1.0 - value)
        return CONSTANTS._replace(**{name: odds / (1.0 + odds)})
    return CONSTANTS._replace(**{name: type(value)(round(factor * value, 12))})


def use(levels: ModelConstants) -> None:
    """Every module of the filter reads these from now on."""
    for name, module in sys.modules.items():
        if name.startswith("rislam_rt.slam") and hasattr(module, "CONSTANTS"):
            module.CONSTANTS = levels  # type: ignore[attr-defined]


def error(path: Path, cycles: int, nudge: float = 0.0) -> float:
    """Error [m] relative to the start in a recorded room's first cycles, root mean square."""
    recording = read_recording(path)
    rng, inputs = np.random.default_rng(0), recording.inputs
    measurements = inputs.measurements[:cycles]
    if nudge:
        measurements = tuple(moved(each, nudge, rng) for each in measurements)
    inputs = inputs._replace(
        time=inputs.time[:cycles], heading=inputs.heading[:cycles], measurements=measurements,
        codes=inputs.codes[:cycles],
    )  # fmt: skip
    answers = replay(inputs, settings(recording.config), recording.scheme, {"slam.filter": "window"}, rng=rng)
    found = np.array([estimate.position for estimate in answers.estimates])
    there = recording.truth.position[:cycles]
    off = found - inputs.start.position - (there - there[0])
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def settings(config: Any) -> dict[str, Any]:
    """A recording's settings without those of rivals, which may have changed since."""
    return {name: value for name, value in config.items() if not name.endswith("_slam")}


def moved(measurement: Any, nudge: float, rng: np.random.Generator) -> Any:
    """A measurement with its delays moved by a share of their deviations."""
    noise = rng.standard_normal(measurement.tau.shape)
    return replace(measurement, tau=measurement.tau + nudge * measurement.tau_std * noise)


def compare(name: str, before: Floats, after: Floats) -> str:
    """A line of the table: errors (N,) of N rooms before and after."""
    ratio = after / before
    low, middle, high = 100.0 * (np.percentile(ratio, [25, 50, 75]) - 1.0)
    whole = 100.0 * (np.median(after) / np.median(before) - 1.0)
    return f"| {name} | {whole:+.0f} % | {middle:+.1f} % ({low:+.0f} to {high:+.0f}) | {int((ratio > 2.0).sum())} |"


def study(paths: list[Path], names: list[str], cycles: int) -> Iterator[str]:
    """The table, line by line."""
    yield "| constant | median error | room by room: median (quartiles) | rooms twice as bad |"
    yield "| --- | --- | --- | --- |"
    base = np.array([error(path, cycles) for path in paths])
    yield compare("chance", base, np.array([error(path, cycles, NUDGE) for path in paths]))
    for name in names:
        for factor, word in ((0.5, "half"), (2.0, "twice")):
            use(changed(name, factor))
            yield compare(f"`{name}`, {word}", base, np.array([error(path, cycles) for path in paths]))
    use(CONSTANTS)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, help="folder with room_*/*.nc")
    parser.add_argument("--rooms", type=int, default=12)
    parser.add_argument("--cycles", type=int, default=200, help="of each room, from the first on")
    parser.add_argument("--pattern", default="*_13dB_*.nc", help="of the files in a room's folder")
    parser.add_argument("--only", nargs="*", default=list(ModelConstants._fields), help="constants")
    chosen = parser.parse_args()
    paths = sorted(chosen.recordings.glob(f"room_*/{chosen.pattern}"))[: chosen.rooms]
    if not paths:
        parser.error(f'no {chosen.pattern} in {chosen.recordings}/room_*: record with save = "components"')
    for line in study(paths, chosen.only, chosen.cycles):
        print(line, flush=True)


if __name__ == "__main__":
    main()
