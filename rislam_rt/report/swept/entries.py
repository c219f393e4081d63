"""Entries of swept studies: scores of one scheme at one point over all repetitions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import Interval
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.report.markdown import NOTHING
from rislam_rt.storage.files import csv_file
from rislam_rt.studies.swept import Group, paired_gain, spread

NEAR_BOUND = 1.5
"""Largest ratio of RMSE to posterior bound at which the bound counts as what limits the error."""
GOOD_ASSOCIATION = 0.95
"""Share of correctly associated components below which data association counts as what limits the error."""


def scheme_entry(group: Group, scheme: str) -> dict[str, Any]:
    """Scores of one scheme at one point of a swept study over all repetitions; errors are RMS over the repetitions."""
    rmse, bound = group.column(scheme, "rmse_m"), group.column(scheme, "bound_m")
    overall, least = spread(rmse), spread(bound)
    known = rmse[~np.isnan(rmse)]
    return {
        **group.point,
        "scheme": scheme,
        "runs": len(known),
        "failed": group.failed(scheme),
        "diverged": group.diverged(scheme),
        **interval_entry("rmse", overall, "_m"),
        **interval_entry("aligned", spread(group.column(scheme, "rmse_aligned_m")), "_m"),
        "median_m": float(np.median(known)) if len(known) else None,
        "bound_m": least.value if least else None,
        "over_bound": overall.value / least.value if overall and least and least.value else None,
        "nees_per_dof": mean_known(group.column(scheme, "nees_per_dof")),
        "association": mean_known(group.column(scheme, "association", "accuracy")),
        "gospa_m": mean_known(group.column(scheme, "map", "gospa_m")),
        **_landmarks(group, scheme),
        **_walls(group, scheme),
    }


def interval_entry(name: str, interval: Interval | None, unit: str = "") -> dict[str, float | None]:
    """Value and ends of an interval as three named numbers of an entry; None where there is none."""
    value, low, high = interval or (None, None, None)
    return {f"{name}{unit}": value, f"{name}_low{unit}": _finite(low), f"{name}_high{unit}": _finite(high)}


def rmse_change(group: Group, scheme: str, reference: Floats) -> Interval | None:
    """Entry of a scheme's change of RMSE against a reference (R,) [m], with its interval, from pairs of equal seeds."""
    gain = paired_gain(group.column(scheme, "rmse_m"), reference)
    return Interval(-gain.value, -gain.upper, -gain.lower) if gain else None


def what_limits(entry: Mapping[str, Any], over_bound: float | None = None) -> str:
    """What limits the error of an entry: `bound` if it is near its posterior bound, else `association` if that is poor,
    or `filter`.

    The error is the agent's, or one that is `over_bound` times its bound.
    """
    over_bound = entry["over_bound"] if over_bound is None else over_bound
    if over_bound is None:
        return NOTHING
    if over_bound <= NEAR_BOUND:
        return "bound"
    return "association" if (entry["association"] or 0.0) < GOOD_ASSOCIATION else "filter"


def entries_csv(entries: Sequence[Mapping[str, Any]]) -> bytes:
    """Encode the entries of a study as CSV; lists are left out, numbers have six digits."""
    names = [name for name, value in entries[0].items() if not isinstance(value, list)] if entries else []
    return csv_file(names, ([_cell(entry[name]) for name in names] for entry in entries))


def by_scheme(entries: Sequence[Mapping[str, Any]], along: str) -> dict[str, list[Mapping[str, Any]]]:
    """Entries of a study grouped by scheme, each group sorted by one number."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for entry in sorted(entries, key=lambda entry: float(entry[along])):
        found.setdefault(entry["scheme"], []).append(entry)
    return found


def failure_notes(groups: Sequence[Group]) -> list[str]:
    """Notes beside the entries of a study, in Markdown: how many runs failed or diverged, with the error messages."""
    runs = sum((len(group.results) - group.missing) * len(group.schemes) for group in groups)
    failed = sum(group.failed(scheme) for group in groups for scheme in group.schemes)
    diverged = sum(group.diverged(scheme) for group in groups for scheme in group.schemes)
    lines = [f"Of {runs} runs {failed} failed and {diverged} diverged (more than 0.5 m and five times the bound off);"]
    lines.append("those that diverged are in every number, those that failed have none and are counted.")
    reasons = list(dict.fromkeys(reason for group in groups for reason in group.reasons))
    return [*lines, *(f"- {reason}" for reason in ["", *reasons[:10]] if reason)]


def panels_of(group: Group, scheme: str) -> list[str]:
    """Names of the landmarks in an entry's scores that are panels."""
    names = group.parts(scheme, "landmarks")
    return [name for name in names if not np.isnan(group.column(scheme, "landmarks", name, "cycles_identified")).all()]


def _landmarks(group: Group, scheme: str) -> dict[str, float | None]:
    """Entry of panel and scatterers: RMS errors and bounds at the runs' end, and the share mapped; of panels the median
    times from which they were audible and identified; None of nothing."""
    panels = panels_of(group, scheme)
    names = group.parts(scheme, "landmarks")
    own = panels if SCHEMES[scheme].panel else []
    found: dict[str, float | None] = {}
    for kind, members in (("ris", own), ("scatterer", [name for name in names if name not in panels])):
        error, bound = (_pooled(group, scheme, "landmarks", members, part) for part in ("final_m", "bound_m"))
        found |= {f"{kind}_m": _rms(error), f"{kind}_bound_m": bound_beside(bound, error)}
        found[f"{kind}_found"] = _share(error)
    for name in ("audible", "identified"):
        since = _pooled(group, scheme, "landmarks", own, f"{name}_from_s")
        known = since[~np.isnan(since)]
        found[f"ris_{name}_s"] = float(np.median(known)) if len(known) else None
    return found


def _walls(group: Group, scheme: str) -> dict[str, float | None]:
    """Entry of a sweep's page: walls found at the end, RMS errors, bounds and own std; share of those heard for
    `HEARD` s in all."""
    names = group.parts(scheme, "walls")
    angle, offset, own, least, near, audible = (
        _pooled(group, scheme, "walls", names, part)
        for part in ("angle_deg", "offset_m", "std_deg", "bound_deg", "bound_m", "audible_s")
    )
    heard = ~(audible < HEARD - 1e-9)  # of long runs it is not known
    return {
        "wall_deg": _rms(angle),
        "wall_bound_deg": bound_beside(least, angle),
        "wall_own_deg": _rms(own),
        "wall_m": _rms(offset),
        "wall_bound_m": bound_beside(near, offset),
        "wall_found": _share(angle[heard]),
        "ghost_walls": mean_known(group.column(scheme, "ghost_walls")),
    }


def _pooled(group: Group, scheme: str, name: str, members: Sequence[str], part: str) -> Floats:
    """One score of all members, e.g. all walls, in all repetitions that have run and not failed, as one array."""
    ran = ~np.isnan(group.column(scheme, "rmse_m"))
    return np.concatenate([np.zeros(0), *(group.column(scheme, name, member, part)[ran] for member in members)])


def bound_beside(bound: Floats, error: Floats) -> float | None:
    """Bound that an entry shows beside the error: RMS of the landmarks or walls that were found; of all if none was."""
    found = ~np.isnan(error)
    return _rms(bound[found] if found.any() else bound)


def _rms(values: Floats) -> float | None:
    """RMS of an entry's values that are known; None without any."""
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def mean_known(values: Floats) -> float | None:
    """Mean of an entry's values that are not NaN; None without any."""
    known = values[~np.isnan(values)]
    return float(np.mean(known)) if len(known) else None


def _share(values: Floats) -> float | None:
    """Share of an entry's values that are not NaN; None of no values."""
    return float(np.mean(~np.isnan(values))) if len(values) else None


def _finite(value: float | None) -> float | None:
    """The value of an entry; None if it is not finite."""
    return value if value is not None and np.isfinite(value) else None


def _cell(value: Any) -> Any:
    """CSV cell of an entry's value, numbers with six digits."""
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else value
