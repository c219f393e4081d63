"""Score card of one estimator in one run: RMSE over its bound, NEES, divergence, walls, landmarks, births."""

from typing import Any

import numpy as np

from rislam_rt import evaluate
from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.errors import ConfigError
from rislam_rt.model import NOTHING, MapEstimate, PathKind
from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.recordings.replay import Answers
from rislam_rt.pipeline.scores.audible_paths import heard_long
from rislam_rt.pipeline.scores.summary import NEAR_LANDMARK
from rislam_rt.pipeline.scores.true_loss import lost_scores
from rislam_rt.studies.score_card.truth import Truth

SETTLED = 10.0
"""[s] Time after which the RMSE is computed once more, when landmarks have been born."""
NEAR_POINT = NEAR_LANDMARK
"""Largest distance [m] of an estimated point from the true landmark that it is matched with.

For landmarks and walls the truth is first shifted to the map's frame, by the error of the start prior."""
GOOD_ANGLE, GOOD_OFFSET = 1.0, 0.02
"""[deg] and [m] Largest errors of a wall that counts as well estimated."""
MIN_PARTS = 3
"""Least number of components associated with a landmark for its kind to be scored."""
OVER_TIME = ("wall_delay_s", "point_delay_s", "panel_delay_s", "births", "births_judged", "births_right")
"""Scores that need the map of every cycle."""


def score_run(truth: Truth, inputs: Inputs, answers: Answers) -> dict[str, Any]:
    """Score card of the estimates of one run against its truth: RMSE, bounds, NEES, divergence,
    walls, landmarks, births.

    None where there is nothing to score, and of delays and births where the last map alone is known. Relative errors
    are without the error of the start prior, which no measurement reduces; `expected_` scores are expected over all
    draws of that error, one of which `ratio` and `nees` show. `lost` is by the truth, from `LOST` [m] on:
    a run's summary may say that it has not `diverged` (0.5 m), and `silent` that the estimator did not notice.

    Raises
    ------
    ConfigError
        The answers are to another number of cycles.
    """
    if len(answers.estimates) != len(truth.position):
        raise ConfigError(
            f"answers: {len(answers.estimates)} estimates of {len(truth.position)} cycles received; give one a cycle"
        )
    told = inputs.start.position - truth.position[0]
    offset = np.array([estimate.position for estimate in answers.estimates]) - truth.position
    covariance = np.array([estimate.covariance for estimate in answers.estimates])
    absolute, relative = np.linalg.norm(offset, axis=1), np.linalg.norm(offset - told, axis=1)
    late = inputs.time >= SETTLED
    drift = truth.position[0] + np.outer(inputs.time, inputs.start.velocity) - truth.position
    scores = {
        **_ratio("", absolute, truth.bound),
        **_ratio("relative_", relative, truth.relative_bound),
        **(_ratio("late_", absolute[late], truth.bound[late]) if late.any() else {}),
        **(_ratio("late_relative_", relative[late], truth.relative_bound[late]) if late.any() else {}),
        "dead_reckoning_m": evaluate.root_mean_square(np.linalg.norm(drift, axis=1)),
        "nees": _nees(offset, covariance, 3),
        "horizontal_nees": _nees(offset, covariance, 2),
        "expected_ratio": _expected_ratio(relative, truth),
        "expected_nees": _expected_nees((offset - told)[:, :2], covariance[:, :2, :2], inputs.start.position_std),
    }
    own = np.array([np.sqrt(np.trace(one[:3, :3])) for one in covariance])
    outcomes = [info.outcome for info in answers.infos]
    scores |= lost_scores(relative, truth.relative_bound, own, inputs.time, outcomes)
    maps = [estimate.map for estimate in answers.estimates]
    scores |= wall_scores(truth, maps, inputs.time, told)
    scores |= point_scores(truth, maps, inputs, told)
    scores |= panel_scores(truth, maps, inputs, told)
    scores |= kind_scores(truth, maps, answers)
    return scores if answers.maps_over_time else scores | dict.fromkeys(OVER_TIME)


def wall_scores(truth: Truth, maps: list[MapEstimate], time: Floats, told: Floats) -> dict[str, Any]:
    """Score card of walls: how many detectable ones the map has, errors, delays, ghost walls."""
    heard, walls = heard_long(truth.wall_audible, time), truth.walls(told)
    first = np.full(len(heard), -1)
    match = np.full(len(heard), -1)
    for cycle, found in enumerate(maps):
        match = evaluate.match_planes(walls, found.wall_normal, found.wall_offset, heard)
        first[(match >= 0) & (first < 0)] = cycle
    last = maps[-1]
    held = np.flatnonzero(match >= 0)
    angle = evaluate.plane_angle(walls, last.wall_normal)[held, match[held]]
    normal, offset = last.wall_normal[match[held]], last.wall_offset[match[held]]
    shift = np.abs(np.einsum("wi,wi->w", normal, walls.middle[held]) - offset)
    return {
        "walls_heard": int(heard.sum()),
        "walls_found": len(held),
        "walls_good": int(np.sum((angle <= GOOD_ANGLE) & (shift <= GOOD_OFFSET))),
        "wall_deg": _median(angle),
        "wall_m": _median(shift),
        "wall_delay_s": _delay(first, truth.wall_audible, time),
        "ghost_walls": int(evaluate.ghost_planes(walls, last.wall_normal, last.wall_offset).sum()),
    }


def point_scores(truth: Truth, maps: list[MapEstimate], inputs: Inputs, told: Floats) -> dict[str, Any]:
    """Score card of landmarks: how many detectable ones the last map has, errors and delays, ghost
    points, GOSPA."""
    there = truth.landmark[: len(truth.landmark) - (truth.panel if inputs.panel is None else 0)]
    audible = truth.landmark_audible[:, : len(there)]
    heard = heard_long(audible, inputs.time)
    match = first = np.full(len(there), -1)
    for cycle, found in enumerate(maps):
        points = np.flatnonzero(found.parent < 0)
        match = evaluate.match_points(found.position[points] - told, there, cutoff=NEAR_POINT)
        first = np.where((match >= 0) & (first < 0), cycle, first)
    last = maps[-1].position[maps[-1].parent < 0] - told
    score = evaluate.gospa(last, there, cutoff=NEAR_POINT)
    held = np.flatnonzero((match >= 0) & heard)
    error = np.linalg.norm(last[match[held]] - there[held], axis=1)
    return {
        "points_heard": int(heard.sum()),
        "points_found": len(held),
        "point_m": _median(error),
        "point_delay_s": _delay(np.where(heard, first, -1), audible, inputs.time),
        "ghost_points": int(score.false),
        "gospa_m": float(score.distance),
    }


def panel_scores(truth: Truth, maps: list[MapEstimate], inputs: Inputs, told: Floats) -> dict[str, Any]:
    """Score card of the panel: whether it is detectable, whether the last map has it, and the delay.

    The map has it where the landmark that it holds for it lies within `NEAR_POINT` of it. A second landmark in the same
    place, which may be nearer, does not change that. Of several panels all that are detectable have to be found; the
    delay is their median. None where there is none, or the estimator was told of none.
    """
    count = int(truth.panel) if inputs.panel is not None else 0  # True is one
    if not count:
        return dict.fromkeys(("panel_heard", "panel_found", "panel_delay_s"))
    first_panel = len(truth.landmark) - count
    there, audible = truth.landmark[first_panel:], truth.landmark_audible[:, first_panel:]
    heard = heard_long(audible, inputs.time)
    has = np.zeros((len(maps), count), dtype=np.bool_)
    for cycle, found in enumerate(maps):
        for panel in range(count):
            row = found.panel_row(panel)
            has[cycle, panel] = row >= 0 and np.linalg.norm(found.position[row] - told - there[panel]) <= NEAR_POINT
    first = np.where(has[-1] & heard, np.argmax(has, axis=0), -1)
    return {
        "panel_heard": bool(heard.any()),
        "panel_found": bool(heard.any() and has[-1, heard].all()),
        "panel_delay_s": _delay(first, audible, inputs.time),
    }


def kind_scores(truth: Truth, maps: list[MapEstimate], answers: Answers) -> dict[str, Any]:
    """Scores of births: how many landmarks were born, and of how many the kind (point or mirror image) is right.

    A point is right if most of its components are paths over a landmark without walls; an image, over a landmark and
    walls. Landmarks with fewer than `MIN_PARTS` components are not scored.
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


def _ratio(name: str, errors: Floats, bound: Floats) -> dict[str, float | None]:
    """Score card: position RMSE [m], RMS posterior bound and their ratio, by name."""
    rmse, least = evaluate.root_mean_square(errors), evaluate.root_mean_square(bound)
    return {f"{name}rmse_m": rmse, f"{name}bound_m": least, f"{name}ratio": rmse / least if least else None}


def _expected_ratio(relative: Floats, truth: Truth) -> float | None:
    """Score card: position RMSE over the posterior bound as expected over all draws of the start prior's error; None
    without a bound.

    Who is told nothing of the room moves with the start, to the last digit: the error is that of the start and the
    `relative` one (K,) [m], which does not hang on it. What the start's draw adds in the mean square is what it adds to
    the bound.
    """
    drawn, least = truth.bound**2 - truth.relative_bound**2, np.mean(truth.bound**2)
    return float(np.sqrt(np.mean(relative**2 + drawn) / least)) if least else None


def _expected_nees(relative: Floats, covariance: Floats, std: float) -> float | None:
    """Score card: NEES of x and y per degree of freedom as expected over all draws of the start prior's error of
    deviation `std` [m] along each axis, from the `relative` error (K, 2) [m] and covariances (K, 2, 2); None where one
    is not positive definite."""
    least, most = np.linalg.eigvalsh(covariance).T
    if not (least > 0.0).all():
        return None
    drawn = std**2 * (1.0 / least + 1.0 / most)
    found = float(np.mean(evaluate.normalised_squares(relative, covariance) + drawn)) / 2.0
    return found if np.isfinite(found) else None


def _nees(offset: Floats, covariance: Floats, count: int) -> float | None:
    """Score card: mean NEES of the absolute position error (K, 3) [m] along the first `count` axes over
    the cycles, per degree of freedom; None if none of them is filtered."""
    axes = np.flatnonzero(np.einsum("kii->ki", covariance[:, :count, :count]).min(axis=0) > 0.0)
    if not len(axes):
        return None
    found = float(np.mean(evaluate.normalised_squares(offset[:, axes], covariance[:, axes[:, None], axes]))) / len(axes)
    return found if np.isfinite(found) else None


def _delay(first: Integers, audible: Booleans, time: Floats) -> float | None:
    """Score card: median time [s] from the first cycle in which a landmark or wall is detectable to the
    first that maps it."""
    known = (first >= 0) & audible.any(axis=0)
    return _median(time[first[known]] - time[np.argmax(audible[:, known], axis=0)])


def _median(values: Floats) -> float | None:
    """Median of a score; None of no values."""
    return float(np.median(values)) if len(values) else None
