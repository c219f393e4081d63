"""Summary of a run's scores for every scheme: errors of agent, landmarks and walls, data association, times."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rislam_rt import evaluate
from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import STEPS, MapEstimate, Scene, SchemeResult, SlamResult
from rislam_rt.pipeline.own_methods import is_own
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.scores.audible_paths import audible_paths, landmarks_audible
from rislam_rt.pipeline.scores.component_sources import component_labels, uses_wall_returns
from rislam_rt.pipeline.scores.loss_causes import loss_scores, unnoticed_lines
from rislam_rt.pipeline.scores.posterior_bound import SchemeBound, scheme_bound
from rislam_rt.pipeline.scores.true_loss import FAR_OVER, lost_scores, silent_loss_lines
from rislam_rt.pipeline.scores.wall_scores import count_ghosts, found_walls, seconds_audible, wall_scores
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings

DIVERGED = 0.5
"""Position error [m] beyond which a run counts as diverged."""
NEAR_LANDMARK = 1.0
"""Largest distance [m] of an estimated point from the true landmark that it is matched with."""


class LandmarkTrack(NamedTuple):
    """Errors of the estimated points matched with the N true landmarks over K cycles."""

    error: Floats
    """(K, N) distance [m] of the matched point from each landmark, NaN where there is none."""
    column: Integers
    """(K, N) column of the matched point in the scheme's result, -1 where there is none."""


def summarise(result: SlamResult) -> dict[str, Any]:
    """All scores of a run and its schemes as a table for JSON."""
    scores = {name: summarise_scheme(result, scheme) for name, scheme in result.schemes.items()}
    return summary_table(result, scores, len(result.scene.agent))


def summary_table(result: SlamResult, scores: Mapping[str, Any], cycles: int) -> dict[str, Any]:
    """Table for JSON of a run of so many cycles, with the scores of its schemes by name; its warnings are all that the
    run ends with on the terminal."""
    return {
        "seed": result.seed, "cycles": cycles, "pipeline": result.name, "scene": result.scene.name,
        "source": result.paths.source, "trace_seconds": result.seconds.get("trace", 0.0),
        "warnings": [*unnoticed_lines(scores), *silent_loss_lines(scores), *result.warnings], "schemes": scores,
    }  # fmt: skip


def summarise_scheme(result: SlamResult, scheme: SchemeResult) -> dict[str, Any]:
    """Scores of one scheme in a run: position RMSE and bound, NEES, landmarks, walls, GOSPA, association, times."""
    scene, truth = result.scene, result.scene.agent.position
    errors = evaluate.position_errors(scheme.position, truth)
    known = scheme.scheme in SCHEMES or is_own(scheme.scheme)
    least = scheme_bound(result.scene, result.paths, scheme.gain, scheme.scheme, result.config) if known else None
    limit = least.agent if least else None
    error, bound = evaluate.root_mean_square(errors), None if limit is None else evaluate.root_mean_square(limit)
    relative = relative_errors(scheme, truth, truth[0])
    squares = nees_per_dof(scheme, truth)
    nees = None if squares is None else float(np.mean(squares))
    panels = len(scene.panels) if scheme.levels else 0
    settings = build_settings(PipelineSpec.model_validate(dict(result.config)), panels)
    use_vt = uses_wall_returns(scheme.scheme, settings)
    score = evaluate.association_score(*component_labels(scene, result.paths, scheme, use_vt=use_vt))
    audible = audible_paths(result.paths.with_gain(scheme.gain), settings, use_vt=use_vt)
    walls = wall_scores(scene, scheme.map, least, seconds_audible(scene, result.paths, audible))
    seconds = dict(zip(STEPS, scheme.seconds.mean(axis=0).tolist(), strict=True))
    return {
        "rmse_m": error,
        "bound_m": bound,
        "over_bound": error / bound if bound else None,
        "final_m": float(errors[-1]),
        "largest_m": float(errors.max()),
        "relative_rmse_m": None if relative is None else evaluate.root_mean_square(relative),
        "relative_bound_m": evaluate.root_mean_square(least.relative) if least else None,
        "rmse_aligned_m": evaluate.rmse(evaluate.align(scheme.position, truth), truth) if len(truth) > 1 else None,
        "nees_per_dof": nees if nees is None or np.isfinite(nees) else None,
        "diverged": has_diverged(errors, limit),
        "outcomes": {name: scheme.outcome.count(name) for name in sorted(set(scheme.outcome))},
        "lost": loss_scores(scheme),
        "true_loss": true_loss(scheme, relative, least),
        "landmarks": landmark_scores(scene, scheme, least, landmarks_audible(scene, result.paths, audible)),
        "walls": walls,
        **found_walls(walls),
        "ghost_walls": count_ghosts(scene, scheme.map),
        "map": map_score(scene, scheme.map, panel=bool(scheme.levels)),
        "association": score._asdict(),
        "step_seconds": seconds,
        "over_budget": over_budget(seconds, result.config["budget"]),
        "seconds": float(scheme.seconds.sum()),
    }


def relative_errors(scheme: SchemeResult, truth: Floats, begin: Floats) -> Floats | None:
    """Errors (K,) [m] relative to the start, for a score: without the error of the position that the estimator was
    told at the true start `begin` (3,), which no measurement in an unknown room reduces; None where it is not known."""
    if scheme.start_position is None:
        return None
    return evaluate.position_errors(scheme.position - truth, scheme.start_position - begin)


def true_loss(scheme: SchemeResult, relative: Floats | None, least: SchemeBound | None) -> dict[str, Any] | None:
    """Score of loss by the truth, of the errors (K,) [m] relative to the start; None where these or their bound are not
    known."""
    if relative is None or least is None:
        return None
    own = np.sqrt(np.trace(scheme.covariance[:, :3, :3], axis1=1, axis2=2))
    return lost_scores(relative, least.relative, own, scheme.time - scheme.time[0], scheme.outcome)


def nees_per_dof(scheme: SchemeResult, truth: Floats) -> Floats | None:
    """Score of consistency: NEES of the position per degree of freedom, (K,); None if all is known."""
    axes = np.flatnonzero(np.einsum("kii->ki", scheme.covariance[:, :3, :3]).min(axis=0) > 0.0)
    if not len(axes):
        return None
    block = scheme.covariance[:, axes[:, None], axes]
    return evaluate.normalised_squares((scheme.position - truth)[:, axes], block) / len(axes)


def has_diverged(errors: Floats, limit: Floats | None) -> bool:
    """Score: whether the error (K,) [m] ever exceeds `DIVERGED`, and `FAR_OVER` times the bound where there is one:
    five standard deviations even along one line."""
    least = DIVERGED if limit is None else np.maximum(DIVERGED, FAR_OVER * limit)
    return bool((errors > least).any())


def map_score(scene: Scene, estimate: MapEstimate, *, panel: bool = True) -> dict[str, Any]:
    """Score of the map: GOSPA [m] (order 2, cutoff `NEAR_LANDMARK`) of its points, without mirror images, against true
    landmarks.

    Panels count among the true landmarks only if the scheme uses them (`panel`).
    """
    points = estimate.position[estimate.parent < 0]
    truth = scene.landmark_positions if panel else scene.landmark_positions[: len(scene.scatterers)]
    found = evaluate.gospa(points, truth, cutoff=NEAR_LANDMARK)
    names = ("gospa_m", "localisation_m", "missed", "false")
    return dict(zip(names, found, strict=True))


def over_budget(seconds: Mapping[str, float], budget: Mapping[str, float]) -> list[str]:
    """Score of computing time: names of the cycle's steps whose mean time exceeds their budget."""
    return [step for step in STEPS if seconds[step] > budget[f"{step}_s"]]


def panel_track(scene: Scene, scheme: SchemeResult, begin: Floats | None = None) -> Integers:
    """Score of the panels: column (K, R) of the landmark that the map holds for each panel, if it lies by it; else -1.

    It is the likeliest, above one half, within `NEAR_LANDMARK` of the panel; the map is shifted by the error of the
    position that the estimator was told at the true start `begin` (3,) [m], the first of the scene's motion by default.
    """
    first = scene.agent.position[0] if begin is None else begin
    shift = np.zeros(3) if scheme.start_position is None else scheme.start_position - first
    column = np.full((len(scheme.position), len(scene.panels)), -1)
    if not scheme.levels or not len(scheme.ident):
        return column
    rows = np.arange(len(column))
    for number, panel in enumerate(scene.panels):
        named = scheme.held & scheme.named(number)
        best = np.argmax(np.where(named, scheme.ris_probability, 0.0), axis=1)
        off = evaluate.position_errors(scheme.landmark_position[rows, best] - shift, panel.center)
        column[:, number] = np.where(named[rows, best] & (off <= NEAR_LANDMARK), best, -1)
    return column


def landmark_track(scene: Scene, scheme: SchemeResult, begin: Floats | None = None) -> LandmarkTrack:
    """Match the map's points (no mirror images) one to one with the true landmarks in every cycle, for their scores.

    A panel is matched with the landmark that the map holds for it where that lies by it (`panel_track`, with `begin`),
    though another may be nearer. Panels are matched with nothing in a scheme that has a plain wall in their place.
    """
    truth = scene.landmark_positions if scheme.levels else scene.landmark_positions[: len(scene.scatterers)]
    error = np.full((len(scheme.position), len(scene.landmarks)), np.nan)
    column = np.full(error.shape, -1)
    points = scheme.held & (scheme.parent < 0)
    if scheme.levels:
        column[:, len(scene.scatterers) :] = panel_track(scene, scheme, begin)
    for cycle in range(len(error)):
        candidates = np.setdiff1d(np.flatnonzero(points[cycle]), column[cycle])
        free = np.flatnonzero(column[cycle, : len(truth)] < 0)
        match = evaluate.match_points(scheme.landmark_position[cycle, candidates], truth[free], cutoff=NEAR_LANDMARK)
        column[cycle, free[match >= 0]] = candidates[match[match >= 0]]
        found = np.flatnonzero(column[cycle] >= 0)
        where = scheme.landmark_position[cycle, column[cycle, found]]
        error[cycle, found] = evaluate.position_errors(where, truth[found])
    return LandmarkTrack(error, column)


def landmark_scores(
    scene: Scene, scheme: SchemeResult, least: SchemeBound | None = None, audible: Booleans | None = None
) -> dict[str, dict[str, Any]]:
    """Scores of each true landmark: position RMSE [m] over the cycles in which it is mapped, last error and bound; of a
    panel also when it was first `audible` (K, N), and when the map first held it, since the run's begin.

    Null where it was never mapped; the bound is null where no path from it was detectable.
    """
    track, panels = landmark_track(scene, scheme), panel_track(scene, scheme)
    scores: dict[str, dict[str, Any]] = {}
    for number, name in enumerate(scene.landmarks):
        error, column = track.error[:, number], track.column[:, number]
        cycles = np.flatnonzero(column >= 0)
        entry: dict[str, Any] = {
            "rmse_m": float(np.sqrt(np.mean(error[cycles] ** 2))) if len(cycles) else None,
            "final_m": float(error[-1]) if column[-1] >= 0 else None,
            "bound_m": least.landmarks.get(name) if least else None,
            "cycles_held": len(cycles),
        }
        if (panel := scene.panel_number(number)) >= 0:
            entry["cycles_identified"] = int(np.sum(panels[:, panel] >= 0))
            entry["identified_last"] = bool(panels[-1, panel] >= 0) if scheme.levels else None
            entry["identified_from_s"] = first_time(panels[:, panel] >= 0, scheme.time)
            if audible is not None:
                heard = audible[:, number] & bool(scheme.levels)
                entry["audible_from_s"] = first_time(heard, scheme.time)
        scores[name] = entry
    return scores


def first_time(true: Booleans, time: Floats) -> float | None:
    """Time [s] since a run's begin of the first cycle (K,) in which what is scored was true; None if it never was."""
    return float(time[np.argmax(true)] - time[0]) if true.any() else None
