"""What associated measurements teach about the landmarks themselves: strength, identity, whether they exist."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.information import amplitude_std
from rislam_rt.model import RisCode
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.identity import (
    add_evidence,
    log_panel,
    log_panel_missed,
    log_scatterer,
    log_scatterer_missed,
    weigh_silence,
)
from rislam_rt.slam.moments import poses_of, square_root
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.candidates import PredictedMeasurements
from rislam_rt.slam.nested.landmark_table import LandmarkTable, image_idents, learn_ratio
from rislam_rt.slam.nested.measurement_prediction import ExpectedReturns, MapBelief
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.returns import NONE, TX, Returns, compact, observe

BELIEF_SAMPLES = 24
"""Samples of the belief over which the panel's predicted gain is averaged."""
TOLD = 2.0
"""Log-likelihood ratio for the panel of a component that only the panel's paths can cause: it may come over walls."""
CERTAIN = 30.0
"""Log odds beyond which a point's identity is no longer in question."""
DRIFT_RATE = 0.04
"""Share of the latest innovation in the running mean."""
SHOWN_RATE = (0.06, 0.03)
"""Share of the latest cycle in the running share of cycles in which a feature showed; on Tx legs, which all come from
where the point is and hide each other, one should not judge as fast."""


class Hits(NamedTuple):
    """A returns that were seen."""

    row: Integers
    """(A,) among the expected ones."""
    pick: Integers
    """(A,) the measurement of each, among those that are left without LOS."""
    white: Floats
    """(A, 3) whitened innovations, zero for returns that measured nothing."""


def learn(
    belief: MapBelief,
    moments: Moments,
    predicted: PredictedMeasurements,
    hits: Hits,
    observations: Observations,
    code: RisCode | None,
    *,
    rng: np.random.Generator,
) -> tuple[LandmarkTable, Integers]:
    """Update the landmark table by this cycle's hits, and say to which ident each of them went."""
    table, expected = belief.table, predicted.expected
    owner, number = expected.owner[hits.row], expected.bounces[hits.row]
    table, names = _name(table, expected, hits.row)
    drift, count = table.drift.copy(), table.hits.copy()
    for place in predicted.measures[hits.row].nonzero()[0]:
        count[owner[place]] += 1
        drift[owner[place]] += DRIFT_RATE * (hits.white[place] - drift[owner[place]])
    occlusion = table.occlusion.copy()
    occlusion[owner[number == 0]] = 0.0
    table = table._replace(
        hits=count, drift=drift, detection_rate=_detection_rate(table, predicted, hits.row), occlusion=occlusion
    )
    # beside something of its strength an amplitude tells of the sum, not of the landmark
    alone = ~predicted.groups.outshone[hits.row] & (predicted.groups.partner[hits.row] < 0)
    for place in (alone & (number == 1)).nonzero()[0]:
        wall, row = int(owner[place]), hits.row[place]
        surplus = observations.log_amplitude[hits.pick[place]] - expected.log_amplitude[row]
        table = learn_ratio(table, wall, float(table.ratio[wall] + surplus))
    plain = alone & (number == 0)
    if plain.any():
        direct = compact(expected.returns, hits.row[plain])
        pick = hits.pick[plain]
        amplitude = np.exp(observations.log_amplitude[pick])
        told = observations.odds_of(table.log_ris.shape[1])[pick]
        table = _weigh(table, belief, moments, direct, amplitude, observations.amplitude_std[pick], told, code, rng=rng)
    silent = (expected.bounces == 0) & ~predicted.groups.outshone & (predicted.groups.partner < 0)
    silent[hits.row] = False
    if silent.any() and belief.ris is not None and code is not None:
        direct = compact(expected.returns, np.flatnonzero(silent))
        table = _weigh_silent(table, belief, moments, direct, code, rng=rng)
    return table, names


def _name(table: LandmarkTable, expected: ExpectedReturns, rows: Integers) -> tuple[LandmarkTable, Integers]:
    """The ident of the landmark (point, image, or wall of a moving image) that each of the returns belongs to."""
    returns, owner = expected.returns, expected.owner[rows]
    names, point = table.ident[owner], returns.point[rows]
    images = ((point != TX) & (expected.bounces[rows] > 0)).nonzero()[0]
    on_rx, on_tx = returns.legs[returns.rx[rows[images]], 1], returns.legs[returns.tx[rows[images]], 1]
    table, names[images] = image_idents(table, point[images], np.where(on_rx != NONE, on_rx, on_tx))
    return table, names


def _detection_rate(table: LandmarkTable, predicted: PredictedMeasurements, hit: Integers) -> Floats:
    """Update of who showed, of those that should have: strong enough, and not beside something stronger.

    A wall is judged by the images of the point that it was found by: those of others may never have been there.
    """
    expected = predicted.expected
    on_tx = expected.returns.legs[expected.returns.tx, 1] != NONE
    here = np.zeros(len(expected.owner), dtype=np.bool_)
    here[hit] = True
    detection_rate = table.detection_rate.copy()
    for row in (expected.likely & ~predicted.groups.outshone & expected.by_parent).nonzero()[0]:
        feature, column = expected.owner[row], int(on_tx[row])
        detection_rate[feature, column] += SHOWN_RATE[column] * (here[row] - detection_rate[feature, column])
    return detection_rate


def _weigh(
    table: LandmarkTable,
    belief: MapBelief,
    moments: Moments,
    direct: Returns,
    amplitude: Floats,
    std: Floats,
    told: Floats,
    code: RisCode | None,
    *,
    rng: np.random.Generator,
) -> LandmarkTable:
    """Update by amplitudes of direct returns: for every strength, and for each panel, by its odds `told` (P, Q)."""
    points = direct.point
    sight = observe(direct, belief.features, table.anchor, belief.poses)
    scatterer = log_scatterer(amplitude, std, sight.tx_length, sight.rx_length, belief.radio)
    panel: Floats = np.full(told.shape, -np.inf)
    if belief.ris is not None and code is not None:
        gains = _sampled_gains(belief, moments, points, code, rng=rng)
        panel = np.stack([log_panel(amplitude, std, gain) for gain in gains], axis=1) + np.minimum(told, 0.0)
    grid, log_ris = add_evidence(table.log_grid[points], table.log_ris[points], scatterer, panel)
    log_ris += np.clip(told, 0.0, TOLD)
    grids, all_ris = table.log_grid.copy(), table.log_ris.copy()
    grids[points], all_ris[points] = grid, np.clip(log_ris, -CERTAIN, CERTAIN)
    if belief.ris is None:
        all_ris[points] = -np.inf
    return table._replace(log_grid=grids, log_ris=all_ris)


def _weigh_silent(
    table: LandmarkTable,
    belief: MapBelief,
    moments: Moments,
    direct: Returns,
    code: RisCode,
    *,
    rng: np.random.Generator,
) -> LandmarkTable:
    """Update by silence of direct returns, of the panels' odds alone: something may stand in the way for long."""
    points = direct.point
    sight = observe(direct, belief.features, table.anchor, belief.poses)
    std = np.full(len(points), amplitude_std(belief.radio))
    threshold = belief.threshold
    scatterer = log_scatterer_missed(std, sight.tx_length, sight.rx_length, belief.radio, threshold)
    gains = _sampled_gains(belief, moments, points, code, rng=rng)
    panels = [np.exp(log_panel_missed(std, gain, threshold)) for gain in gains]
    weight = np.exp(table.log_grid[points])
    missed = np.stack([*panels, np.sum(weight * np.exp(scatterer), axis=1) / weight.sum(axis=1)], axis=1)
    occlusion, log_ris = table.occlusion.copy(), table.log_ris.copy()
    occlusion[points], surplus = weigh_silence(table.occlusion[points], missed)
    log_ris[points] = np.clip(log_ris[points] + surplus, -CERTAIN, CERTAIN)
    return table._replace(log_ris=log_ris, occlusion=occlusion)


def _sampled_gains(
    belief: MapBelief, moments: Moments, points: Sequence[int] | Integers, code: RisCode, *, rng: np.random.Generator
) -> list[Complexes]:
    """Gain (P, S) of each panel if it were at each landmark, over samples of pose and map together."""
    assert belief.ris is not None
    columns = np.concatenate([np.arange(3), moments.columns(np.asarray(points))])
    root = square_root(moments.covariance[np.ix_(columns, columns)])
    draws = moments.mean[columns] + rng.standard_normal((BELIEF_SAMPLES, root.shape[1])) @ root.T
    poses = poses_of(draws[:, :3], belief.poses.heading, belief.body)
    centers = np.swapaxes(draws[:, 3:].reshape(BELIEF_SAMPLES, -1, 3), 0, 1)
    return [
        panel_path_gain(sheet, part, centers, poses.tx[None], poses.rx[None], np.ones(1), belief.radio)
        for sheet, part in zip(belief.ris.panels, belief.ris.parts(code), strict=True)
    ]
