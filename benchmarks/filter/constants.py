"""Does the window filter hang on a hand-set number? Each at half and at twice its value, over recorded rooms.

Every constant of `slam.model_constants` (with `--numbers`: every number at the top of the filter's modules) is changed
by itself, and the same recorded measurements are filtered again. Probabilities have their odds halved and doubled,
counts stay whole and at least one, grids get half or twice the points. The package is imported anew with the changed
value, so that default arguments, tables made from it and modules that import it follow. The table says by how much the
median error relative to the start changes, and, as a median over a dozen rooms jitters by more than most constants do,
the spread of the change room by room. The first line says what chance alone does: the same constants, delays moved by a
billionth of a deviation. Record first: a pipeline of kind `unseen` with `save = "components"` (see
docs/results/unseen.md). Run with one thread of linear algebra (OPENBLAS_NUM_THREADS=1):
`python benchmarks/filter/constants.py RECORDINGS --rooms 12`.
"""

import argparse
import ast
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats

ROOT = Path(__file__).parents[2]
TABLE = "rislam_rt.slam.model_constants"
NUDGE = 1e-9
"""Reported deviations by which chance moves a measurement: next to nothing, but it decides what was undecided."""
PROBABILITIES = ("rare", "cleared", "shown", "square", "upright", "born", "company", "DAMPING", "ALIGNED", "CUT")
"""Numbers whose odds are halved and doubled."""
LOGARITHMS = ("DISMISSAL", "FAR_STRONGER")
"""Numbers that are logarithms: what they are the logarithm of is halved and doubled."""
LABELS = (
    "TX", "NONE", "UNTOLD", "OTHER", "PANEL", "UNUSED", "REMOVED", "NEW", "KNOWN", "OVER", "UNKNOWN", "UP",
    "TURN", "HEAD", "POSE", "ONE", "TWO", "FIRST", "COLUMNS", "AXES", "DIAGONAL", "DIGITS", "WALL",
    "KNOWN_WALL", "WALL_KNOWN", "POINT", "OVER_RX", "OVER_TX", "OVER_SAME", "TWO_WALLS", "BESIDE", "IMAGE",
    "TX_IMAGE", "BOTH_LEGS", "BOTH_WAYS", "THEN_WALL", "WALL_THEN", "OTHER_LEG", "IS_WALL", "IS_IMAGE", "IS_FAR",
    "IS_POINT", "COMMON", "MORE_WALLS", "UNIT_TILTS", "WIDTHS", "PANEL_STD", "WANDER", "MORE_UNKNOWN",
)  # fmt: skip
"""Indices, names of kinds, unit vectors, and what follows from others: nothing that was set by hand."""


class Changed(MetaPathFinder):
    """Imports one module with one number at its top, or constant of its table, at another value."""

    def __init__(self, module: str, name: str, factor: float) -> None:
        self.module, self.name, self.factor = module, name, factor

    def find_spec(self, fullname: str, path: Any, target: ModuleType | None = None) -> ModuleSpec | None:
        """Where the module to change is found."""
        found = PathFinder.find_spec(fullname, path) if fullname == self.module else None
        if found:
            found.loader = _Loader(fullname, str(found.origin), self.name, self.factor)
        return found


class _Loader(SourceFileLoader):
    """Runs a module with one statement more, behind the one that sets the number."""

    def __init__(self, module: str, path: str, name: str, factor: float) -> None:
        super().__init__(module, path)
        self.number, self.factor = name, factor

    def exec_module(self, module: ModuleType) -> None:
        tree = ast.parse(Path(self.path).read_text(encoding="utf-8"))
        more = ast.parse(f"{self.number} = changed_({self.number!r}, {self.number}, {self.factor})").body[0]
        for block in [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))]:
            places = [place for place, node in enumerate(block) if self.number in names_set(node)]
            if places:
                block.insert(places[-1] + 1, more)
        vars(module)["changed_"] = changed
        exec(compile(tree, self.path, "exec"), vars(module))


def changed(name: str, value: Any, factor: float) -> Any:
    """A number `factor` times as large, by what it is."""
    if name in PROBABILITIES:
        odds = factor * value / (1.0 - value)
        return odds / (1.0 + odds)
    if name in LOGARITHMS:
        return value + np.log(factor)
    if isinstance(value, np.ndarray) and value.dtype.kind == "i":
        return np.unique(np.maximum(np.rint(changed(name, 1.0 * value, factor)), min(1, value[0]))).astype(np.int64)
    if isinstance(value, np.ndarray) and value.ndim == 1 and len(value) > 3:
        place = np.linspace(0.0, len(value) - 1.0, round(factor * (len(value) - 1)) + 1)
        return np.interp(place, np.arange(len(value)), value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def names_set(node: ast.stmt) -> list[str]:
    """Names that a statement sets."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    flat = [one for target in targets for one in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return [target.id for target in flat if isinstance(target, ast.Name)]


def constants() -> list[tuple[str, str]]:
    """The table's module, and the name of each of its constants."""
    return [(TABLE, name) for name in import_module(TABLE).ModelConstants._fields]


def numbers() -> list[tuple[str, str]]:
    """Module and name of each number at the top of one of the filter's modules."""
    slam, found = ROOT / "rislam_rt" / "slam", []
    for file in [*sorted(slam.glob("*.py")), *sorted((slam / "window").rglob("*.py"))]:
        if file.stem not in ("nested_config", "config", "input_checks", "__init__"):
            module = import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))
            for name in [name for node in ast.parse(file.read_text(encoding="utf-8")).body for name in names_set(node)]:
                if name.isupper() and name not in LABELS and isinstance(vars(module)[name], int | float | np.ndarray):
                    found.append((module.__name__, name))
    return found


def import_anew(change: Changed | None) -> None:
    """Forget the package, and import it with a number changed, or as it is."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "rislam_rt"]:
        del sys.modules[name]
    sys.meta_path[:] = [finder for finder in sys.meta_path if not isinstance(finder, Changed)]
    sys.meta_path[:0] = [change] if change else []


def error(path: Path, cycles: int, nudge: float = 0.0) -> float:
    """Error [m] relative to the start in a recorded room's first cycles, root mean square."""
    package = import_module("rislam_rt")
    recording = package.read_recording(path)
    rng, inputs = np.random.default_rng(0), recording.inputs
    measurements = inputs.measurements[:cycles]
    if nudge:
        measurements = tuple(moved(each, nudge, rng) for each in measurements)
    inputs = inputs._replace(
        time=inputs.time[:cycles], heading=inputs.heading[:cycles], measurements=measurements,
        codes=inputs.codes[:cycles],
    )  # fmt: skip
    chosen = settings(recording.config)
    answers = package.replay(inputs, chosen, recording.scheme, {"slam.filter": "window"}, rng=rng)
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
    mean = 100.0 * (np.exp(np.log(ratio).mean()) - 1.0)
    twice = int((ratio > 2.0).sum())
    return f"| {name} | {whole:+.0f} % | {middle:+.1f} % ({low:+.0f} to {high:+.0f}) | {mean:+.1f} % | {twice} |"


def study(paths: list[Path], names: list[tuple[str, str]], cycles: int) -> Iterator[str]:
    """The table, line by line."""
    yield "| number | median error | room by room: median (quartiles) | geometric mean | rooms twice as bad |"
    yield "| --- | --- | --- | --- | --- |"
    base = np.array([error(path, cycles) for path in paths])
    yield compare("chance", base, np.array([error(path, cycles, NUDGE) for path in paths]))
    for module, name in names:
        place = "" if module == TABLE else f" ({module.rpartition('.')[2]})"
        for factor, word in ((0.5, "half"), (2.0, "twice")):
            import_anew(Changed(module, name, factor))
            yield compare(f"`{name}`{place}, {word}", base, np.array([error(path, cycles) for path in paths]))
    import_anew(None)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, help="folder with room_*/*.nc")
    parser.add_argument("--rooms", type=int, default=12)
    parser.add_argument("--cycles", type=int, default=200, help="of each room, from the first on")
    parser.add_argument("--pattern", default="*_13dB_*.nc", help="of the files in a room's folder")
    parser.add_argument("--numbers", action="store_true", help="those at the top of modules, not the table's")
    parser.add_argument("--only", nargs="*", help="names")
    chosen = parser.parse_args()
    paths = sorted(chosen.recordings.glob(f"room_*/{chosen.pattern}"))[: chosen.rooms]
    if not paths:
        parser.error(f'no {chosen.pattern} in {chosen.recordings}/room_*: record with save = "components"')
    every = numbers() if chosen.numbers else constants()
    names = [each for each in every if not chosen.only or each[1] in chosen.only]
    for line in study(paths, names, chosen.cycles):
        print(line, flush=True)


if __name__ == "__main__":
    main()
