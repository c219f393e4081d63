"""What may go wrong in a run, with the measurements from some cycle on or with the whole of it (see `hard_cases`)."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body, Measurement, RadioConfig, RisCode, RisSpec
from rislam_rt.slam import SlamConfig, StartPrior

GAP = 50
"""Cycles of a gap."""


class Cycle(NamedTuple):
    """What the filter is given in one cycle."""

    measurement: Measurement
    code: RisCode | None
    dt: float
    heading: float


class Case(NamedTuple):
    """One run."""

    kind: str
    seed: int
    start: StartPrior
    body: Body
    panel: RisSpec | None
    radio: RadioConfig
    config: SlamConfig
    cycles: Sequence[Cycle]
    truth: Floats
    """(K, 3) [m]."""


Spoiler = Callable[[Measurement, np.random.Generator], Measurement]


def _every(m: Measurement, **factor: float) -> Measurement:
    """Fields multiplied."""
    return replace(m, **{name: getattr(m, name) * value for name, value in factor.items()})


def _set(m: Measurement, **value: Any) -> Measurement:
    """Fields set to one value."""
    return replace(m, **{name: np.full_like(getattr(m, name), number) for name, number in value.items()})


def _rows(m: Measurement, rows: Any) -> Measurement:
    """Some components, in any order and as often as wanted."""
    names = ("tau", "cosines", "amplitude", "tau_std", "cosines_std", "amplitude_std")
    return replace(m, from_panel=None, **{name: getattr(m, name)[rows] for name in names})


def _noise(m: Measurement, factor: float, rng: np.random.Generator) -> Measurement:
    """Errors of `factor` times the deviations on top."""
    tau = np.abs(m.tau + factor * m.tau_std * rng.standard_normal(len(m)))
    return replace(m, tau=tau, cosines=m.cosines + factor * m.cosines_std * rng.standard_normal((len(m), 2)))


def clutter(count: int, *, rng: np.random.Generator) -> Measurement:
    """Components that mean nothing, even over delay and disc, of any strength."""
    angle, radius = rng.uniform(-np.pi, np.pi, count), np.sqrt(rng.uniform(size=count))
    cosines = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    amplitude, ones = 10.0 ** rng.uniform(-6.5, -3.0, count), np.ones(count)
    tau = rng.uniform(0.0, 80e-9, count)
    return Measurement(tau, cosines, amplitude, 3e-11 * ones, 0.01 * np.ones((count, 2)), 3e-7 * ones)


def _twice(m: Measurement, rng: np.random.Generator) -> Measurement:
    """Each component again, with errors of its own: as of landmarks in one place."""
    both = _rows(m, np.repeat(np.arange(len(m)), 2))
    return _noise(both, 0.7, rng)


def _mixed(m: Measurement, rng: np.random.Generator) -> Measurement:
    """Deviations that are zero, tiny, as they were, or infinite."""
    scale = rng.choice([0.0, 1e-12, 1.0, np.inf], size=(len(m), 4))
    return replace(
        m,
        tau_std=np.where(scale[:, 0] > 0.0, scale[:, 0], 0.0) * m.tau_std,
        cosines_std=scale[:, 1:3] * m.cosines_std,
        amplitude_std=scale[:, 3] * m.amplitude_std,
    )


SPOILERS: dict[str, Spoiler] = {
    "nothing wrong": lambda m, rng: m,
    "no measurements": lambda m, rng: _rows(m, np.zeros(0, dtype=np.int64)),
    "one component": lambda m, rng: _rows(m, rng.integers(len(m), size=min(1, len(m)))),
    "all clutter": lambda m, rng: clutter(60, rng=rng),
    "clutter of a crowd": lambda m, rng: clutter(300, rng=rng),
    "zero amplitude": lambda m, rng: _set(m, amplitude=0.0),
    "zero amplitude and deviation": lambda m, rng: _set(m, amplitude=0.0, amplitude_std=0.0),
    "huge amplitude": lambda m, rng: _every(m, amplitude=1e12),
    "infinite amplitude": lambda m, rng: _set(m, amplitude=np.inf),
    "tiniest amplitude": lambda m, rng: _set(m, amplitude=5e-324, amplitude_std=5e-324),
    "infinite deviations": lambda m, rng: _set(m, tau_std=np.inf, cosines_std=np.inf, amplitude_std=np.inf),
    "zero deviations": lambda m, rng: _set(m, tau_std=0.0, cosines_std=0.0, amplitude_std=0.0),
    "mixed deviations": _mixed,
    "huge noise, told": lambda m, rng: _every(_noise(m, 30.0, rng), tau_std=30.0, cosines_std=30.0),
    "huge noise, not told": lambda m, rng: _noise(m, 30.0, rng),
    "deviations too small": lambda m, rng: _every(m, tau_std=0.1, cosines_std=0.1),
    "every component twice": lambda m, rng: _rows(m, np.repeat(np.arange(len(m)), 2)),
    "every component twice, noisy": _twice,
    "any order": lambda m, rng: _rows(m, rng.permutation(len(m))),
    "delays beyond the room": lambda m, rng: replace(m, tau=m.tau + 1e-6),
    "delays without end": lambda m, rng: _set(m, tau=np.inf),
    "delay zero": lambda m, rng: _set(m, tau=0.0),
    "negative delays": lambda m, rng: replace(m, tau=-m.tau),
    "one delay": lambda m, rng: _set(m, tau=2e-8),
    "one direction": lambda m, rng: _set(m, cosines=0.3),
    "off the disc": lambda m, rng: _set(m, cosines=2.0),
    "on the horizon": lambda m, rng: _set(m, cosines=np.sqrt(0.5)),
    "directions of another": lambda m, rng: replace(m, cosines=rng.permutation(m.cosines)),
    "mirrored": lambda m, rng: replace(m, cosines=-m.cosines),
}
"""What may happen to measurements, from some cycle on."""


def _gap(case: Case, rng: np.random.Generator) -> Case:
    """Nothing heard for a while in the middle."""
    first = (len(case.cycles) - GAP) // 2
    cycles = list(case.cycles)
    for row in range(first, first + GAP):
        cycles[row] = cycles[row]._replace(measurement=SPOILERS["no measurements"](cycles[row].measurement, rng))
    return case._replace(cycles=cycles)


def _jump(case: Case, rng: np.random.Generator) -> Case:
    """No cycles at all for a while: one long step."""
    first = (len(case.cycles) - GAP) // 2
    long = case.cycles[first + GAP]._replace(dt=sum(c.dt for c in case.cycles[first : first + GAP + 1]))
    cycles = [*case.cycles[:first], long, *case.cycles[first + GAP + 1 :]]
    return case._replace(cycles=cycles, truth=np.delete(case.truth, np.s_[first : first + GAP], axis=0))


def _told(case: Case, rng: np.random.Generator, **error: Any) -> Case:
    """A start that is wrong beyond what it says."""
    angle = rng.uniform(-np.pi, np.pi)
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    fields = {
        name: getattr(case.start, name) + size * (way if name != "heading" else 1.0) for name, size in error.items()
    }
    return case._replace(start=replace(case.start, **fields))


def _prior(case: Case, **std: float) -> Case:
    return case._replace(start=replace(case.start, **std))


def each(case: Case, change: Callable[[int, Cycle], Cycle]) -> Case:
    return case._replace(cycles=[change(row, cycle) for row, cycle in enumerate(case.cycles)])


def _codes(case: Case, rng: np.random.Generator) -> Case:
    """Codes that were never applied."""
    assert case.panel is not None
    shape = (len(case.cycles), case.panel.rows, case.panel.cols)
    index = rng.integers(case.panel.levels, size=shape)
    return each(case, lambda row, c: c._replace(code=RisCode(index[row], 4)))


CHANGES: dict[str, Callable[[Case, np.random.Generator], Case]] = {
    "gap of 50 cycles": _gap,
    "step of 5 s": _jump,
    "no time passes": lambda case, rng: each(case, lambda row, c: c._replace(dt=0.0)),
    "time stops at times": lambda case, rng: each(case, lambda row, c: c._replace(dt=c.dt * (row % 3 > 0))),
    "start wrong by 1 m": lambda case, rng: _told(case, rng, position=1.0),
    "speed wrong by 0.3 m/s": lambda case, rng: _told(case, rng, velocity=0.3),
    "start known exactly": lambda case, rng: _prior(_told(case, rng), position_std=0.0, velocity_std=0.0),
    "start known to 10 m": lambda case, rng: _prior(case, position_std=10.0, velocity_std=3.0, heading_std=1.0),
    "compass wrong by 0.5 rad": lambda case, rng: each(case, lambda row, c: c._replace(heading=c.heading + 0.5)),
    "compass spins": lambda case, rng: each(case, lambda row, c: c._replace(heading=1e3 * row)),
    "codes never applied": _codes,
    "no codes told": lambda case, rng: each(case, lambda row, c: c._replace(code=None)),
    "no panel known": lambda case, rng: case._replace(panel=None),
}
"""What may happen to a run as a whole."""
