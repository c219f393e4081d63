"""Does the window filter hang on a constant? Each at half and at twice its value, over recorded rooms.

Probabilities have their odds halved and doubled. Every constant of `slam.window.levels` is changed by itself, and the
same recorded measurements are filtered again. The table says by how much the median error relative to the start
changes, and, as a median over a dozen rooms jitters by more than most constants do, the spread of the change room by
room. A last line says what chance alone does: the same constants, measurements moved by a billionth of a deviation.
Record first: a pipeline of kind `unseen` with `save = "components"` (see docs/results/unseen.md). Run:
`python benchmarks/constants.py RECORDINGS --rooms 12` with one thread of linear algebra (OPENBLAS_NUM_THREADS=1).
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import rislam_rt.slam.window  # noqa: F401  every module that reads the table
from rislam_rt import read_recording, replay, score_run
from rislam_rt.arrays import Floats
from rislam_rt.slam.window.levels import LEVELS, Levels

PROBABILITIES = ("rare", "cleared", "shown", "square", "upright", "born", "dead")
"""Constants whose odds are halved and doubled."""
NUDGE = 1e-9
"""Reported deviations by which chance moves a measurement: next to nothing, but it decides what was undecided."""


def changed(name: str, factor: float) -> Levels:
    """The table with one constant at another value."""
    value = getattr(LEVELS, name)
    if name in PROBABILITIES:
        odds = factor * value / (1.0 - value)
        return LEVELS._replace(**{name: odds / (1.0 + odds)})
    return LEVELS._replace(**{name: type(value)(round(factor * value, 12))})


def use(levels: Levels) -> None:
    """Every module of the filter reads these from now on."""
    for name, module in sys.modules.items():
        if name.startswith("rislam_rt.slam.window") and hasattr(module, "LEVELS"):
            module.LEVELS = levels  # type: ignore[attr-defined]


def error(path: Path, nudge: float = 0.0) -> tuple[float, float]:
    """Error [m] relative to the start in a recorded room, root mean square, and whether the run was lost."""
    recording = read_recording(path)
    rng, inputs = np.random.default_rng(0), recording.inputs
    if nudge:
        inputs = inputs._replace(measurements=tuple(moved(each, nudge, rng) for each in inputs.measurements))
    answers = replay(inputs, settings(recording.config), recording.scheme, {"slam.filter": "window"}, rng=rng)
    score = score_run(recording.truth, inputs, answers)
    return float(score["relative_rmse_m"]), float(score["lost"])  # type: ignore[arg-type]


def settings(config: Any) -> dict[str, Any]:
    """A recording's settings without those of rivals, which may have changed since."""
    return {name: value for name, value in config.items() if not name.endswith("_slam")}


def moved(measurement: Any, nudge: float, rng: np.random.Generator) -> Any:
    """A measurement with its delays moved by a share of their deviations."""
    noise = rng.standard_normal(measurement.tau.shape)
    return replace(measurement, tau=measurement.tau + nudge * measurement.tau_std * noise)


def compare(name: str, before: Floats, after: Floats) -> str:
    """A line of the table: errors (N, 2) and losses of N rooms before and after."""
    ratio = after[:, 0] / before[:, 0] - 1.0
    low, middle, high = 100.0 * np.percentile(ratio, [25, 50, 75])
    whole = 100.0 * (np.median(after[:, 0]) / np.median(before[:, 0]) - 1.0)
    lost = f"{int(before[:, 1].sum())} to {int(after[:, 1].sum())}"
    return f"| {name} | {whole:+.0f} % | {middle:+.1f} % ({low:+.0f} to {high:+.0f}) | {lost} |"


def study(paths: list[Path], names: list[str]) -> Iterator[str]:
    """The table, line by line."""
    yield "| constant | median error | room by room: median (quartiles) | lost |"
    yield "| --- | --- | --- | --- |"
    base = np.array([error(path) for path in paths])
    yield compare("chance", base, np.array([error(path, NUDGE) for path in paths]))
    for name in names:
        for factor, word in ((0.5, "half"), (2.0, "twice")):
            use(changed(name, factor))
            yield compare(f"`{name}`, {word}", base, np.array([error(path) for path in paths]))
    use(LEVELS)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, help="folder with room_*/*.nc")
    parser.add_argument("--rooms", type=int, default=12)
    parser.add_argument("--pattern", default="*_13dB_*.nc", help="of the files in a room's folder")
    parser.add_argument("--only", nargs="*", default=list(Levels._fields), help="constants")
    chosen = parser.parse_args()
    paths = sorted(chosen.recordings.glob(f"room_*/{chosen.pattern}"))[: chosen.rooms]
    if not paths:
        parser.error(f'no {chosen.pattern} in {chosen.recordings}/room_*: record with save = "components"')
    for line in study(paths, chosen.only):
        print(line, flush=True)


if __name__ == "__main__":
    main()
