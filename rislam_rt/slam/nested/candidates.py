"""Candidates for this cycle's measurements: expected returns of the map first, tracks behind them."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import merged_pull
from rislam_rt.slam.associate import DIAGONAL, Candidates, near_pairs, squared_distance
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.landmark_table import LandmarkTable
from rislam_rt.slam.nested.measurement_prediction import ExpectedReturns, MapBelief
from rislam_rt.slam.nested.tracks import AMPLITUDE_WANDER, LandmarkTracks
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, same_side
from rislam_rt.slam.returns import TX, Returns, linearise

INSIDE, OUTSIDE = 0.9, 1.1
"""Gap in units of the resolution cell below which two paths certainly, and above which they certainly do not, merge."""
TWIN_GAIN, TWIN_SPREAD = 0.2, 0.6
"""Mean and standard deviation of the log amplitude of two equal paths of random phase, over that of one."""
PROVEN_HITS = 80
"""Measurements of a wall by the point it was found by, before images of other points in it may move the belief."""
SURE = 8.0
"""Log odds from which on the panel's landmark is held to have the panel's returns, and no other."""
LANDMARK_ODDS, TRACK_ODDS, HIDDEN_ODDS = np.log(0.9), np.log(0.5), np.log(0.01)
"""Log probability that an expected return, a track, and a track where the map expects a return, shows in a cycle."""


class UnresolvedGroups(NamedTuple):
    """What becomes of R returns that share resolution cells with others."""

    partner: Integers
    """(R,) the reciprocal that a return comes out as one with, -1 for none."""
    absorbed: Booleans
    """(R,) whether it comes out as part of something stronger, and not by itself."""
    disturbance: Floats
    """(R, 3) standard deviation by which others in its cell shift it."""
    outshone: Booleans
    """(R,) whether something at least half as strong is, or may be, in the same cell."""


class PredictedMeasurements(NamedTuple):
    """R expected returns, linearised about the mean belief."""

    expected: ExpectedReturns
    seen: Floats
    """(R, 3)."""
    covariance: Floats
    """(R, 3, 3) from pose and map, without the measurement's noise."""
    log_amplitude: Floats
    """(R,) with the reciprocal's share where the two come out as one."""
    log_amplitude_std: Floats
    """(R,)."""
    measures: Booleans
    """(R,) whether it may move the belief; the others only explain what is seen."""
    groups: UnresolvedGroups
    cell: Floats
    """(3,) resolution cell."""
    side: Integers
    """(R,) (see `tracks.Observations`)."""


def look_ahead(
    belief: MapBelief, expected: ExpectedReturns, moments: Moments, tracks: LandmarkTracks, apart: bool = False
) -> PredictedMeasurements:
    """Candidates of association for the next cycle, with uncertainty; `apart`: panel returns come separately."""
    returns, table = expected.returns, belief.table
    linear = linearise(returns, belief.features, table.anchor, belief.poses)
    seen, by_feature = linear.seen, linear.by_feature
    flat = np.zeros((len(seen), 3, len(moments.mean)))
    flat[..., :3], flat[..., 6] = linear.by_pose, linear.by_heading(belief.poses, moments.position)
    flat[..., POSE:] = by_feature.reshape(len(seen), 3, 3 * len(table.ident))
    cell = belief.sensor.cell_length
    side, likely = (
        return_sides(returns, table, odds) if apart else np.full(len(seen), UNTOLD) for odds in (SURE, -np.inf)
    )
    groups = merge_returns(seen, expected, tracks, cell, likely)
    both = (groups.partner >= 0).nonzero()[0]
    log_amplitude, log_amplitude_std = expected.log_amplitude.copy(), expected.log_amplitude_std.copy()
    log_amplitude[both] += TWIN_GAIN
    log_amplitude_std[both] = np.hypot(log_amplitude_std[both], TWIN_SPREAD)
    for field in (seen, flat):
        field[both] = 0.5 * (field[both] + field[groups.partner[both]])
    spread = (flat.reshape(-1, flat.shape[-1]) @ moments.covariance).reshape(flat.shape)
    covariance = spread @ np.swapaxes(flat, 1, 2)
    measures = expected.by_parent | ((expected.bounces == 1) & (table.hits[expected.owner] >= PROVEN_HITS))
    return PredictedMeasurements(
        expected, seen, covariance, log_amplitude, log_amplitude_std, measures, groups, cell, side
    )


def return_sides(returns: Returns, table: LandmarkTable, odds: float) -> Integers:
    """(R,) which candidate returns run over a panel, once that is named and its log odds are above `odds`.

    Those of no panel are known for that once all panels are.
    """
    point = returns.point
    sure = [row for panel, row in enumerate(table.holders) if row >= 0 and table.log_ris[row, panel] > odds]
    sides = np.where((point == TX) | (len(sure) == table.log_ris.shape[1]), OTHER, UNTOLD)
    for panel, row in enumerate(table.holders):
        if row in sure:
            sides[point == row] = PANEL + panel
    return sides


def merge_returns(
    seen: Floats, expected: ExpectedReturns, tracks: LandmarkTracks, cell: Floats, side: Integers
) -> UnresolvedGroups:
    """Candidates merged as the receiver will: from the strongest down, each takes in all that is in its cell.

    Phases change by a turn every half wavelength of motion: a weaker path shifts the stronger by the root mean square
    of what `merged_pull` says of the gap. A reciprocal is as strong as its twin, so that the two come out halfway
    between, whatever the phases.
    """
    count, shiny = len(seen), tracks.specular.nonzero()[0]
    place = np.concatenate([seen, tracks.mean[shiny, :, 0]])
    strength = np.concatenate([expected.log_amplitude, tracks.log_amplitude[shiny]])
    surplus = strength[None] - strength[:, None]
    reach = np.zeros(surplus.shape)
    for axis in (place / cell).T:  # axis by axis: half the time of one three-dimensional array
        np.maximum(reach, np.abs(axis - axis[:, None]), out=reach)
    np.fill_diagonal(reach, np.inf)
    sides = np.append(side, tracks.side[shiny])
    reach[~same_side(sides, sides)] = np.inf
    inside, around = reach < INSIDE, (reach < OUTSIDE) & (surplus <= 0.0)
    partner, taken, leads = np.full(count, -1), np.zeros(len(strength), bool), np.ones(len(strength), bool)
    crowded = np.flatnonzero((reach < 1.0).any(axis=1))
    for leader in crowded[np.argsort(-strength[crowded], kind="stable")]:
        if taken[leader]:
            leads[leader] = False
            continue
        taken |= inside[leader]
        twin = expected.twin[leader] if leader < count else -1
        if twin >= 0 and reach[leader, twin] < 1.0:
            partner[leader], taken[twin] = twin, True
    strong, weak = (around & leads[:, None]).nonzero()
    ratio = np.exp(surplus[strong, weak])
    partners = np.append(partner, np.full(len(shiny), -1))[strong] == weak
    pull, spread = merged_pull(np.where(partners, 0.0, ratio))
    variance = np.zeros(place.shape)
    np.add.at(variance, strong, (pull**2 + spread)[:, None] * (place[weak] - place[strong]) ** 2)
    outshone = taken.copy()
    outshone[weak] = True
    outshone[strong[(ratio > 0.5) & ~partners]] = True
    return UnresolvedGroups(partner, taken[:count], np.sqrt(variance[:count]), outshone[:count])


def candidates(predicted: PredictedMeasurements, tracks: LandmarkTracks, hidden: Booleans) -> Candidates:
    """Candidates of association: expected returns, then the tracks that are not `hidden` (T,) behind one."""
    spread = predicted.covariance.copy()
    spread[:, DIAGONAL, DIAGONAL] += predicted.groups.disturbance**2
    follow = track_covariance(tracks)
    wander = np.where(tracks.specular, 0.3, AMPLITUDE_WANDER)
    odds = np.where(hidden, HIDDEN_ODDS, TRACK_ODDS)
    return Candidates(
        np.concatenate([predicted.seen, tracks.mean[..., 0]]),
        np.concatenate([spread, follow]),
        np.concatenate([predicted.log_amplitude, tracks.log_amplitude]),
        np.concatenate([predicted.log_amplitude_std, wander]),
        np.concatenate([np.where(predicted.groups.absorbed, -1e6, LANDMARK_ODDS), odds]),
        np.concatenate([predicted.side, tracks.side]),
    )


def track_covariance(tracks: LandmarkTracks) -> Floats:
    """(T, 3, 3) covariance of the predicted measurement of each track, as a candidate."""
    follow = np.zeros((len(tracks.misses), 3, 3))
    follow[:, DIAGONAL, DIAGONAL] = tracks.covariance[..., 0, 0]
    return follow


def hidden_tracks(predicted: PredictedMeasurements, tracks: LandmarkTracks, gate: float) -> Booleans:
    """(T,) whether a track is no candidate: it runs where the map expects a return of its strength (wall returns: where
    one is expected).

    Such a track would keep the measurements that prove the map right; it gives way to a return that fits at all.
    """
    if not len(predicted.seen) or not len(tracks.misses):
        return np.zeros(len(tracks.misses), dtype=np.bool_)
    fade = np.abs(tracks.log_amplitude[:, None] - predicted.log_amplitude)
    alike = fade < 3.0 * np.hypot(predicted.log_amplitude_std, 0.3)
    alike &= ~tracks.specular[:, None] | (predicted.expected.returns.point == TX)
    alike &= same_side(tracks.side, predicted.side)
    spread = predicted.covariance.copy()
    spread[:, DIAGONAL, DIAGONAL] += predicted.groups.disturbance**2
    pairs = near_pairs(tracks.mean[..., 0], track_covariance(tracks), predicted.seen, spread, alike, gate)
    hidden = np.zeros(len(tracks.misses), dtype=np.bool_)
    hidden[pairs.row] = True
    return hidden


def explained(
    predicted: PredictedMeasurements, seen: Floats, covariance: Floats, gate: float, side: int = UNTOLD
) -> Integers:
    """Candidate returns of a side within the gate of one prediction (3,) with covariance (3, 3), whatever their
    strength."""
    distance, _ = squared_distance(seen - predicted.seen, predicted.covariance + covariance)
    return ((distance < gate) & same_side(np.array([side]), predicted.side)[0]).nonzero()[0]
