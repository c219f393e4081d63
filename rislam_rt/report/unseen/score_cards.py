"""Score cards of a study in unseen rooms: statistics of the scores over all rooms, and by class of room and motion."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import Interval, bootstrap, median_over_runs, share_interval
from rislam_rt.report.swept.entries import mean_known
from rislam_rt.studies.swept.sweep import SNR
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.store import DONE

CONSISTENT = (0.7, 2.0)
"""Range of a run's NEES per degree of freedom that counts as consistent."""


class SchemeRun(NamedTuple):
    """Scores of one scheme's run in one unseen room."""

    series: str
    """Variant, SNR and scheme, as far as they differ in the study."""
    ident: str
    """Identity of its cell."""
    scheme: str
    room: int
    """Seed of the room."""
    traits: Mapping[str, Any]
    """Properties of the room."""
    scores: Mapping[str, Any]
    """Empty if it failed."""
    failed: str
    """Error message; empty if it did not fail."""


def read_runs(rows: Sequence[Row]) -> list[SchemeRun]:
    """All runs of a study in unseen rooms from its cells, ordered by series and room; missing cells are left out."""
    keys = {key: {row.cell.point.get(key) for row in rows} for key in ("variant", SNR)}
    schemes = {name for row in rows for name in row.result.get("schemes", {})}
    found = []
    for row in rows:
        point = row.cell.point
        parts = [str(point["variant"])] if len(keys["variant"]) > 1 else []
        parts += [f"{point[SNR]:g} dB"] if len(keys[SNR]) > 1 else []
        if row.state == DONE:
            for scheme, scores in sorted(row.result["schemes"].items()):
                name = ", ".join([*parts, *([scheme] if len(schemes) > 1 or not parts else [])])
                failed = str(scores.get("failed", ""))
                traits = row.result["traits"]
                kept = {} if failed else scores
                found.append(SchemeRun(name, row.cell.ident, scheme, int(str(point["room"])), traits, kept, failed))
        elif row.failed:
            message = f"{row.state}: {row.message}"
            name = ", ".join(parts) or "all"
            found.append(SchemeRun(name, row.cell.ident, "", int(str(point["room"])), {}, {}, message))
    order = {name: number for number, name in enumerate(dict.fromkeys(run.series for run in found))}
    return sorted(found, key=lambda run: (order[run.series], run.room))


def _banded(name: str, limits: Sequence[float], unit: str = "") -> Callable[[Mapping[str, Any]], str]:
    """Function that classifies an unseen room by a number, for score cards: below the first limit, between two, from
    the last on."""

    def band(traits: Mapping[str, Any]) -> str:
        number = int(np.searchsorted(limits, traits[name], side="right"))
        if number == 0:
            return f"below {limits[0]:g}{unit}"
        if number == len(limits):
            return f"from {limits[-1]:g}{unit}"
        return f"{limits[number - 1]:g} to {limits[number]:g}{unit}"

    return band


CLASSES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "motion": lambda traits: str(traits["motion"]),
    "plan": lambda traits: traits["shape"] if traits["shape"] == "convex" else str(traits["shape"]).upper(),
    "ceiling": lambda traits: str(traits["ceiling"]),
    "size": _banded("size", (6.0, 15.0), " m"),
    "reflection": _banded("reflection", (0.4, 0.65)),
    "furniture": _banded("pieces", (1, 4)),
    "panel": lambda traits: str(traits["panel"]),
    "scatterers below the agent": lambda traits: "some" if traits["below"] else "none",
    "scatterers hidden": lambda traits: "some" if traits["hidden"] else "none",
    "speed": _banded("speed", (0.1, 0.25), " m/s"),
}
"""Functions that classify a room by its properties, by name of the property."""


def card(runs: Sequence[SchemeRun]) -> dict[str, Any]:
    """Score card of runs in unseen rooms: medians with intervals, 95th percentiles, shares with intervals, means."""
    good = [run for run in runs if run.scores]
    entry: dict[str, Any] = {"runs": len(good), "failed": len(runs) - len(good)}
    for name in (
        "rmse_m", "ratio", "late_rmse_m", "late_ratio", "relative_rmse_m", "relative_ratio", "late_relative_rmse_m",
        "late_relative_ratio", "relative_bound_m", "dead_reckoning_m", "nees", "horizontal_nees", "expected_ratio",
        "expected_nees", "wall_delay_s", "point_delay_s", "panel_delay_s", "wall_deg", "wall_m", "point_m", "gospa_m",
    ):  # fmt: skip
        entry |= _spread(name, column(good, name))
    nees = column(good, "nees")
    entry["nees_mean"] = mean_known(nees)
    entry["horizontal_nees_mean"] = mean_known(column(good, "horizontal_nees"))
    inside = int(np.sum((nees >= CONSISTENT[0]) & (nees <= CONSISTENT[1])))
    entry |= _share("consistent", inside, int(np.sum(~np.isnan(nees))))
    entry |= _share("lost", _count(good, "lost"), len(good))
    entry |= _share("silent", _count(good, "silent"), len(good))
    for name, of in (
        ("walls_found", "walls_heard"), ("walls_good", "walls_heard"), ("points_found", "points_heard"),
        ("panel_found", "panel_heard"), ("births_right", "births_judged"),
    ):  # fmt: skip
        entry |= _share(name, _count(good, name), _count(good, of))
    for name in ("births", "ghost_walls", "ghost_points"):
        entry[name] = mean_known(column(good, name))
    return entry


def class_cards(runs: Sequence[SchemeRun]) -> list[dict[str, Any]]:
    """Score card of every class of rooms, for all properties by which rooms are classified."""
    known = [run for run in runs if run.traits]
    cards = []
    for division, of in CLASSES.items():
        members: dict[str, list[SchemeRun]] = {}
        for run in known:
            members.setdefault(of(run.traits), []).append(run)
        cards += [{"division": division, "class": name, **card(members[name])} for name in in_order(members)]
    return cards


def in_order(names: Iterable[str]) -> list[str]:
    """Sort names of classes of unseen rooms: `below ...` first, `from ...` last, the others by name."""
    return sorted(names, key=lambda name: (not name.startswith("below"), name.startswith("from"), name))


def by_series(runs: Sequence[SchemeRun]) -> dict[str, list[SchemeRun]]:
    """Group runs in unseen rooms by their series, a score card for each."""
    found: dict[str, list[SchemeRun]] = {}
    for run in runs:
        found.setdefault(run.series, []).append(run)
    return found


def cycle_times(
    runs: Mapping[str, Sequence[SchemeRun]], timings: Sequence[Mapping[str, Any]]
) -> dict[str, float | None]:
    """Median CPU time [ms] of the estimator per cycle for a score card, by series; a cell's last time counts."""
    told = {entry["ident"]: entry.get("timing", {}) for entry in timings}
    found: dict[str, float | None] = {}
    for name, members in runs.items():
        known = [told.get(run.ident, {}).get(run.scheme, {}).get("cycle_s") for run in members]
        values = [1e3 * value for value in known if value is not None]
        found[name] = float(np.median(values)) if values else None
    return found


def column(runs: Sequence[SchemeRun], name: str) -> Floats:
    """One score of all runs in unseen rooms, (R,), for score cards; NaN where there is none."""
    found = [run.scores.get(name) for run in runs]
    return np.array([np.nan if value is None else value for value in found], dtype=np.float64)


def _count(runs: Sequence[SchemeRun], name: str) -> int:
    """Sum on a score card of a score that counts."""
    return int(np.nansum(column(runs, name)))


def _spread(name: str, values: Floats) -> dict[str, float | None]:
    """Spread of a score on a score card: median with its 95 % interval, and 95th percentile, by name."""
    known = values[~np.isnan(values)]
    low = high = None
    if len(known) > 1:
        _, low, high = bootstrap(known, rng=np.random.default_rng(0), statistic=median_over_runs, resamples=1000)
    median, p95 = (float(np.quantile(known, q)) if len(known) else None for q in (0.5, 0.95))
    return {name: median, f"{name}_low": low, f"{name}_high": high, f"{name}_p95": p95}


def _share(name: str, count: int, runs: int) -> dict[str, Any]:
    """Share `count` of `runs` with its interval on a score card, by name."""
    found = share_interval(count, runs) if runs and count <= runs else Interval(np.nan, np.nan, np.nan)
    value, low, high = (None if np.isnan(part) else float(part) for part in found)
    return {name: value, f"{name}_low": low, f"{name}_high": high, f"{name}_count": count, f"{name}_of": runs}
