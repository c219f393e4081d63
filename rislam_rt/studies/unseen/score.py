"""The score card of one run of one estimator: error, ratio to the bounds, consistency, births, walls, ghosts."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.evaluate import (
    ghost_planes,
    gospa,
    match_planes,
    match_points,
    normalised_squares,
    plane_angle,
    root_mean_square,
)
from rislam_rt.model import NOTHING, MapEstimate, PathKind
from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.recordings.replay import Answers
from rislam_rt.pipeline.scores.audible import heard_long
from rislam_rt.studies.unseen.truth import Truth

SETTLED = 10.0
"""[s] after which the error is counted once more: time for births."""
LOST, FAR_OVER, LASTING = 0.1, 5.0, 1.0
"""Lost is a relative error beyond `LOST` [m] and `FAR_OVER` relative bounds for `LASTING` [s] without a break."""
NEAR_POINT = 1.0
"""Distance [m] from a true landmark within which an estimate stands for it. For it and for walls the truth is laid into
the map's frame first, by the start's own error."""
GOOD_ANGLE, GOOD_OFFSET = 1.0, 0.02
"""[deg] and [m] within which a wall is found well."""
MIN_PARTS = 3
"""Components that a landmark must have got for its kind to be judged."""


class Errors(NamedTuple):
    """Position errors over K cycles [m]."""

    absolute: Floats
    relative: Floats
    """To the true start: without the error that the agent was told its start with, which nothing can mend."""


def score_run(truth: Truth, inputs: Inputs, answers: Answers) -> dict[str, Any]:
    """All scores, plain data; None where there is nothing to score."""
    told = inputs.start.position - truth.position[0]
    errors = _errors(truth, answers, told)
    late = inputs.time >= SETTLED
    drift = truth.position[0] + np.outer(inputs.time, inputs.start.velocity) - truth.position
    scores = {
        **_ratio("", errors.absolute, truth.bound),
        **_ratio("relative_", errors.relative, truth.relative_bound),
        **(_ratio("late_", errors.absolute[late], truth.bound[late]) if late.any() else {}),
        **(_ratio("late_relative_", errors.relative[late], truth.relative_bound[late]) if late.any() else {}),
        "dead_reckoning_m": root_mean_square(np.linalg.norm(drift, axis=1)),
        "nees": _nees(truth, answers),
    }
    own = np.array([np.sqrt(np.trace(estimate.covariance[:3, :3])) for estimate in answers.estimates])
    outcomes = [info.outcome for info in answers.infos]
    scores |= lost_scores(errors.relative, truth.relative_bound, own, inputs.time, outcomes)
    maps = [estimate.map for estimate in answers.estimates]
    scores |= wall_scores(truth, maps, inputs.time, told)
    scores |= point_scores(truth, maps, inputs, told)
    return scores | kind_scores(truth, maps, answers)


def lost_scores(relative: Floats, bound: Floats, own: Floats, time: Floats, outcomes: list[Any]) -> dict[str, Any]:
    """Score of being lost: whether the estimate was, when, and whether it was so in silence.

    It is not in silence if an outcome says so from then on, or if the believed deviation `own` (K,) [m] does.
    """
    far = relative > np.maximum(LOST, FAR_OVER * bound)
    lost = _lasting(far, time)
    if not lost.any():
        return {"lost": False, "silent": False, "lost_at_s": None}
    first = int(np.argmax(lost))
    said = any(str(outcome) == "diverged" for outcome in outcomes[first:])
    surprised = _lasting(far & (relative > FAR_OVER * own), time).any()
    return {"lost": True, "silent": bool(surprised and not said), "lost_at_s": float(time[first])}


def _lasting(flag: Booleans, time: Floats) -> Booleans:
    """Cycles of a score from which on a flag (K,) stays for `LASTING` seconds."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else LASTING
    length = max(1, round(LASTING / step))
    return np.asarray(np.convolve(flag, np.ones(length), "valid") >= length) if len(flag) >= length else flag[:0]


def wall_scores(truth: Truth, maps: list[MapEstimate], time: Floats, told: Floats) -> dict[str, Any]:
    """Walls found at the end of those heard, how well, how soon, and planes that stand for none."""
    heard, walls = heard_long(truth.wall_audible, time), truth.walls(told)
    first = np.full(len(heard), -1)
    match = np.full(len(heard), -1)
    for cycle, found in enumerate(maps):
        match = match_planes(walls, found.wall_normal, found.wall_offset, heard)
        first[(match >= 0) & (first < 0)] = cycle
    last = maps[-1]
    held = np.flatnonzero(match >= 0)
    angle = plane_angle(walls, last.wall_normal)[held, match[held]]
    normal, offset = last.wall_normal[match[held]], last.wall_offset[match[held]]
    shift = np.abs(np.einsum("wi,wi->w", normal, walls.middle[held]) - offset)
    return {
        "walls_heard": int(heard.sum()),
        "walls_found": len(held),
        "walls_good": int(np.sum((angle <= GOOD_ANGLE) & (shift <= GOOD_OFFSET))),
        "wall_deg": _median(angle),
        "wall_m": _median(shift),
        "wall_delay_s": _delay(first, truth.wall_audible, time),
        "ghost_walls": int(ghost_planes(walls, last.wall_normal, last.wall_offset).sum()),
    }


def point_scores(truth: Truth, maps: list[MapEstimate], inputs: Inputs, told: Floats) -> dict[str, Any]:
    """Landmarks found at the end of those heard, how well, how soon; the panel apart; points that stand for none."""
    there = truth.landmark[: len(truth.landmark) - (truth.panel and inputs.panel is None)]
    audible = truth.landmark_audible[:, : len(there)]
    heard = heard_long(audible, inputs.time)
    first, named = np.full(len(there), -1), np.full(len(there), -1)
    match = first
    for cycle, found in enumerate(maps):
        points = np.flatnonzero(found.parent < 0)
        match = match_points(found.position[points] - told, there, cutoff=NEAR_POINT)
        first[(match >= 0) & (first < 0)] = cycle
        held = np.flatnonzero(match >= 0)
        ris = found.ris_probability[points[match[held]]] > 0.5
        named[held[ris & (named[held] < 0)]] = cycle
    last = maps[-1].position[maps[-1].parent < 0] - told
    score = gospa(last, there, cutoff=NEAR_POINT)
    held = np.flatnonzero((match >= 0) & heard)
    error = np.linalg.norm(last[match[held]] - there[held], axis=1)
    panel = inputs.panel is not None and bool(heard[-1])
    return {
        "points_heard": int(heard.sum()),
        "points_found": len(held),
        "point_m": _median(error),
        "point_delay_s": _delay(np.where(heard, first, -1), audible, inputs.time),
        "panel_heard": panel,
        "panel_found": bool(panel and match[-1] >= 0 and named[-1] >= 0),
        "panel_delay_s": _delay(named[-1:], audible[:, -1:], inputs.time) if panel else None,
        "ghost_points": int(score.false),
        "gospa_m": float(score.distance),
    }


def kind_scores(truth: Truth, maps: list[MapEstimate], answers: Answers) -> dict[str, Any]:
    """Score of birth kinds: how many landmarks were born, and of how many the kind was right.

    A point is right if most of its components came straight from a landmark; an image, over a wall from one; what got
    fewer than `MIN_PARTS` components is not judged.
    """
    parts: dict[int, list[int]] = {}
    for cycle, info in enumerate(answers.infos):
        labels = np.asarray(info.landmark)
        for label, path in zip(labels, truth.component_path[cycle], strict=False):
            if label >= 0 and path != NOTHING:
                parts.setdefault(int(label), []).append(int(path))
    is_image: dict[int, bool] = {}
    for found in maps:
        is_image |= dict(zip(found.ident.tolist(), (found.parent >= 0).tolist(), strict=True))
    kinds = np.append(truth.path_kind, -1)
    straight, over = (PathKind.PS, PathKind.RIS), (PathKind.VS, PathKind.VRIS)
    judged = [
        np.mean(np.isin(kinds[parts[ident]], over if image else straight)) > 0.5
        for ident, image in is_image.items()
        if len(parts.get(ident, ())) >= MIN_PARTS
    ]
    return {"births": len(is_image), "births_judged": len(judged), "births_right": int(np.sum(judged))}


def _errors(truth: Truth, answers: Answers, told: Floats) -> Errors:
    offset = np.array([estimate.position for estimate in answers.estimates]) - truth.position
    return Errors(np.linalg.norm(offset, axis=1), np.linalg.norm(offset - told, axis=1))


def _ratio(name: str, errors: Floats, bound: Floats) -> dict[str, float | None]:
    """Score of a run: RMSE, RMS bound and their ratio."""
    rmse, least = root_mean_square(errors), root_mean_square(bound)
    return {f"{name}rmse_m": rmse, f"{name}bound_m": least, f"{name}ratio": rmse / least if least else None}


def _nees(truth: Truth, answers: Answers) -> float | None:
    """Score of consistency: mean NEES over the cycles, per degree of freedom, of the absolute error."""
    covariance = np.array([estimate.covariance for estimate in answers.estimates])
    axes = np.flatnonzero(np.einsum("kii->ki", covariance[:, :3, :3]).min(axis=0) > 0.0)
    if not len(axes):
        return None
    offset = np.array([estimate.position for estimate in answers.estimates]) - truth.position
    found = float(np.mean(normalised_squares(offset[:, axes], covariance[:, axes[:, None], axes]))) / len(axes)
    return found if np.isfinite(found) else None


def _delay(first: Integers, audible: Booleans, time: Floats) -> float | None:
    """Score of delay: median time [s] from the first audible cycle to the first match, of what was ever matched and
    audible."""
    known = (first >= 0) & audible.any(axis=0)
    return _median(time[first[known]] - time[np.argmax(audible[:, known], axis=0)])


def _median(values: Floats) -> float | None:
    return float(np.median(values)) if len(values) else None
