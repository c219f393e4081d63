"""Does the filter survive what no design reckons with? Seeded hard cases in the paper's room, for either filter.

Each case is a stretch of the paper's walk, 10 to 40 cycles (gaps more), with one thing gone wrong and settings drawn
at random. After every cycle the estimate and the diagnostics must be finite, every covariance symmetric and positive
semidefinite, the outcome a proper value; warnings count as failures. Beside it is counted what became of the belief:
`lost` runs end farther from the truth, relative to how wrong their start was, than 0.1 m and five of their own standard
deviations; `said` are those among them that reported `diverged` at some time; `back` the runs that reported it and are
not lost. Absolute position is unobservable: after a start that is wrong by 1 m the whole map is off by 1 m, which no
filter can notice, so that errors are taken relative to the start. Run:
`python benchmarks/filter/hard_cases.py [--cases 1000] [--filter nested | window] [--seed 1] [--kind KIND]
[--json FILE]`.
"""

import argparse
import json
import traceback
import warnings
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from hard_kinds import CHANGES, GAP, SPOILERS, Case, Cycle, each

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, measure
from rislam_rt.model import Paths, RadioConfig, RisCode, RisLegs, RxArray, Scene, SensorModel, SlamEstimate, Trajectory
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene
from rislam_rt.slam import NestedConfig, SlamConfig, StartPrior, StepInfo, StepOutcome, estimate, init, predict, step
from rislam_rt.slam.window import WindowState
from rislam_rt.slam.window.smoother import window_gaussian

ROOM = Path(__file__).parents[2] / "scenes" / "paper_room"
ROUNDING = 1e-10
"""Least eigenvalue [m^2], negated, that passes for zero: a new feature's prior of 100 m^2 times 1e-12."""


class Verdict(NamedTuple):
    """What became of a run."""

    kind: str
    seed: int
    faults: tuple[str, ...]
    outcomes: tuple[str, ...]
    drift: float
    """Horizontal error [m] at the end, relative to the start's."""
    std: float
    """What the filter holds for its own horizontal standard deviation at the end [m]."""

    @property
    def lost(self) -> bool:
        """Whether the end is far off the truth, and farther than the filter believes."""
        return self.drift > max(0.1, 5.0 * self.std)

    @property
    def said(self) -> bool:
        """Whether divergence was reported in any cycle."""
        return StepOutcome.DIVERGED in self.outcomes


ROOMS = ("coincident landmarks", "one antenna element", "a row of antennas", "blinding radio", "deaf radio")
"""What may be wrong with the room or the radio."""
KINDS = (*SPOILERS, *CHANGES, *ROOMS, "two at once", "jump of the agent")


@cache
def _scene(kind: str) -> Scene:
    scene = load_scene(ROOM)
    if kind != "coincident landmarks":
        return scene
    ball = scene.scatterers[0]
    assert scene.ris is not None
    shifts = [ball.position, ball.position, ball.position + 1e-3, scene.ris.center - [0.0, 0.0, 1e-3]]
    balls = tuple(replace(ball, name=f"ball{n}", position=place) for n, place in enumerate(shifts))
    return replace(scene, scatterers=balls)


def _radio(kind: str) -> RadioConfig:
    radio = RadioConfig()
    arrays = {"one antenna element": RxArray(1, 1), "a row of antennas": RxArray(1, 16)}
    loudness = {"blinding radio": 1e-8, "deaf radio": 1e4}
    return replace(
        radio, array=arrays.get(kind, radio.array), noise_psd=radio.noise_psd * loudness.get(kind, 1e-1)
    )  # fmt: skip


@cache
def _paths(kind: str, depth: int) -> Paths:
    """Of the whole walk; all kinds with nothing wrong with the room share them."""
    scene = _scene(kind)
    return ImageSourceChannel(scene, _radio(kind), depth).paths(scene.agent)


def _stretch(paths: Paths, cycles: slice) -> Paths:
    """The paths of some cycles."""
    names = ("valid", "tau", "departure", "arrival", "gain", "vertices")
    fields: dict[str, Any] = {name: getattr(paths, name)[cycles] for name in names}
    if paths.ris is not None:
        fields["ris"] = RisLegs(paths.ris.tx[cycles], paths.ris.rx[cycles], paths.ris.tx_leg, paths.ris.rx_leg)
    return replace(paths, **fields)


def _settings(engine: str, rng: np.random.Generator) -> SlamConfig:
    """Every option that the filter has, at random; the first draw of three is the default."""
    config, own, headings = SlamConfig(), NestedConfig(), ("known", "estimated")
    if rng.uniform() >= 0.4:
        config = SlamConfig(
            sigma_a=float(rng.choice([0.01, 1e-6, 1.0])),
            use_vt=bool(rng.integers(2)),
            heading=str(rng.choice(headings)),
            height=str(rng.choice(["known", "estimated"])),
            max_bounces=int(rng.integers(3)),
        )
        own = NestedConfig(birth_cycles=int(rng.choice([12, 6, 1])))
    if engine != "nested":
        return config
    # as many as a thousand runs allow; the laws looked at here do not depend on their number
    own = replace(own, adaptive=False, num_agents=100, num_points=128, min_agents=100, min_points=128)
    return replace(config, filter="nested", nested=own)


def draw_case(kind: str, seed: int, engine: str, most: int = 40) -> Case:
    """One hard case of up to `most` cycles; the same seed gives the same case."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    long = kind in ("gap of 50 cycles", "step of 5 s")
    count = int(rng.integers(10, most + 1)) + (GAP if long else 0)
    scene, radio, depth = _scene(kind), _radio(kind), int(rng.choice([1, 1, 2]))
    first = int(rng.integers(len(scene.agent) - count))
    stretch = slice(first, first + count)
    motion: Trajectory = scene.agent[stretch]
    assert scene.ris is not None
    panel = scene.ris.spec
    index = rng.integers(panel.levels, size=(count, panel.rows, panel.cols))
    code = RisCode(index, panel.levels)
    paths = rephase(_stretch(_paths(kind if kind in ROOMS else "", depth), stretch), code)
    # merged components are one more thing that may go wrong, and not always wanted
    receiver = ReceiverConfig(estimator="bound", merge=bool(rng.integers(2)), alternation=False)
    cycles = []
    for row in range(count):
        heading = float(motion.heading[row])
        measurement, _ = measure(_stretch(paths, slice(row, row + 1)), 0, heading, radio, receiver, None, rng=rng)
        cycles.append(Cycle(measurement, RisCode(index[row], panel.levels), 0.1 if row else 0.0, heading))
    wrong = 0.01 * rng.standard_normal((2, 3)) * [1.0, 1.0, 0.0]
    start = StartPrior(motion.position[0] + wrong[0], motion.velocity[0] + wrong[1], float(motion.heading[0]))
    config = _settings(engine, rng)
    case = Case(kind, seed, start, motion.body, panel, radio, config, cycles, motion.position)
    return _spoilt(case, rng)


def _spoilt(case: Case, rng: np.random.Generator) -> Case:
    """The case with what its kind stands for."""
    kind = case.kind
    if kind == "two at once":
        for name in rng.choice([*SPOILERS, *CHANGES], size=2, replace=False):
            if str(name) not in ("gap of 50 cycles", "step of 5 s"):
                case = _spoilt(case._replace(kind=str(name)), rng)._replace(kind=kind)
        return case
    if kind == "jump of the agent":
        # what is measured after it is measured elsewhere: the first half of the walk again
        half = len(case.cycles) // 2
        again = [c._replace(measurement=case.cycles[row].measurement) for row, c in enumerate(case.cycles[half:])]
        truth = np.concatenate([case.truth[:half], case.truth[: len(again)]])
        return case._replace(cycles=[*case.cycles[:half], *again], truth=truth)
    if kind in CHANGES:
        return CHANGES[kind](case, rng)
    if kind in SPOILERS:
        since = int(rng.choice([0, len(case.cycles) // 2]))
        return each(
            case, lambda row, c: c._replace(measurement=SPOILERS[kind](c.measurement, rng)) if row >= since else c
        )
    return case


def run_case(case: Case) -> Verdict:
    """Lead the filter through a case and look at all it says."""
    rng = np.random.default_rng(case.seed)
    faults: list[str] = []
    outcomes: list[str] = []
    drift, std = np.inf, 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            state = init(case.start, case.body, case.panel, SensorModel(case.radio), case.config, rng=rng)
            for row, cycle in enumerate(case.cycles):
                state, info = step(
                    state, cycle.measurement, cycle.code, cycle.dt, cycle.heading, case.config, rng=rng
                )  # fmt: skip
                belief = estimate(state, case.config)
                found = faults_of(belief, info, len(cycle.measurement), _believed(state))
                found += faults_of(predict(state, 0.1, case.config), info, len(cycle.measurement))
                faults += [f"cycle {row}: {fault}" for fault in found]
                outcomes.append(info.outcome)
            offset = case.start.position - case.truth[0]
            drift = float(np.linalg.norm((belief.position - case.truth[-1] - offset)[:2]))
            std = float(np.sqrt(np.trace(belief.covariance[:2, :2])))
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = next(
                (f for f in reversed(traceback.extract_tb(error.__traceback__)) if "rislam_rt" in f.filename), place
            )
            faults.append(f"{type(error).__name__} in {Path(where.filename).name}:{where.lineno}: {error}"[:150])
    return Verdict(case.kind, case.seed, tuple(faults), tuple(outcomes), drift, std)


def _believed(state: Any) -> Floats:
    """Covariance of all that the filter holds of the present."""
    return window_gaussian.now((state if isinstance(state, WindowState) else state.front).window)[1]


def faults_of(belief: SlamEstimate, info: StepInfo, count: int, covariance: Floats | None = None) -> list[str]:
    """What is wrong with an estimate and the diagnostics of `count` measurements; nothing if all is well."""
    room = belief.map
    numbers = {
        "position": belief.position, "velocity": belief.velocity, "heading": belief.heading, "samples": belief.samples,
        "landmarks": room.position, "probability": room.ris_probability, "strength": room.strength,
        "normal": room.wall_normal, "offset": room.wall_offset, "wall deviation": room.wall_std,
        "ess": info.ess, "nis": info.nis, "evidence": info.log_evidence,
    }  # fmt: skip
    faults = [f"{name} not finite" for name, value in numbers.items() if not np.isfinite(value).all()]
    spreads = {"pose": belief.covariance[None], "landmark": room.covariance}
    if covariance is not None:
        spreads["belief"] = covariance[None]
    for name, matrix in spreads.items():
        faults += [f"{name} covariance {fault}" for fault in _not_covariance(matrix)]
    if info.outcome not in set(StepOutcome):
        faults.append(f"outcome {info.outcome}")
    if info.landmark.shape != (count,):
        faults.append("labels of another shape")
    if len(set(room.ident.tolist())) != len(room.ident):
        faults.append("identities not unique")
    if not ((room.ris_probability >= 0.0) & (room.ris_probability <= 1.0 + 1e-12)).all():
        faults.append("probability out of range")
    return faults


def _not_covariance(matrix: Floats) -> list[str]:
    """Why matrices (..., D, D) are no covariances."""
    if not matrix.size:
        return []
    if not np.isfinite(matrix).all():
        return ["not finite"]
    scale = ROUNDING * max(1.0, float(np.abs(matrix).max()))
    faults = []
    if np.abs(matrix - np.swapaxes(matrix, -1, -2)).max() > scale:
        faults.append("not symmetric")
    least = float(np.linalg.eigvalsh(0.5 * (matrix + np.swapaxes(matrix, -1, -2))).min())
    return [*faults, f"not positive ({least:.1e})"] if least < -scale else faults


def draw_cases(count: int, seed: int, engine: str, kinds: Sequence[str] = KINDS) -> list[tuple[str, int, str]]:
    """Kinds and seeds of so many cases, all kinds alike often."""
    return [(kinds[number % len(kinds)], seed * 100_000 + number, engine) for number in range(count)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--filter", choices=("window", "nested"), default="window")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    begin, verdicts = process_time(), []
    kinds = (arguments.kind,) if arguments.kind else KINDS
    for kind, seed, engine in draw_cases(arguments.cases, arguments.seed, arguments.filter, kinds):
        verdict = run_case(draw_case(kind, seed, engine))
        verdicts.append(verdict)
        for fault in verdict.faults[:2]:
            print(f"{kind} ({seed}): {fault}", flush=True)
    table = tabulate(verdicts)
    show(table)
    print(f"{arguments.filter}: {process_time() - begin:.0f} s of CPU time")
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n")


def tabulate(verdicts: Sequence[Verdict]) -> dict[str, dict[str, Any]]:
    """Counts by kind, and of all."""
    groups: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in verdicts:
        groups[verdict.kind].append(verdict)
    groups["all"] = list(verdicts)
    return {
        name: {
            "cases": len(group),
            "faulty": sum(bool(v.faults) for v in group),
            "cycles": dict(Counter(outcome for v in group for outcome in v.outcomes)),
            "lost": sum(v.lost for v in group),
            "said": sum(v.lost and v.said for v in group),
            "back": sum(v.said and not v.lost for v in group),
            "median drift_m": float(np.median([v.drift for v in group])),
        }
        for name, group in groups.items()
    }


def show(table: dict[str, dict[str, Any]]) -> None:
    """The table, one line a kind."""
    names = [str(outcome) for outcome in StepOutcome]
    print(f"{'':30s}{'cases':>6s}{'faulty':>7s}" + "".join(f"{n:>16s}" for n in names) + "  lost said back  drift [m]")
    for kind, row in table.items():
        counts = "".join(f"{row['cycles'].get(name, 0):16d}" for name in names)
        print(
            f"{kind:30s}{row['cases']:6d}{row['faulty']:7d}{counts}{row['lost']:6d}{row['said']:5d}{row['back']:5d}"
            f"{row['median drift_m']:11.3f}"
        )


if __name__ == "__main__":
    main()
