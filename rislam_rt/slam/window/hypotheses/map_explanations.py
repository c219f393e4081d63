"""Explanations of tracks by the map: returns that it predicts, in which nothing is free, with what shares their cells.

What else the map expects in a return's cell may be silent, and what is heard there moves a component by anything up to
what it can. So a track is weighed under every strength of its company, and as the return by itself.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import Poses, linearise
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, compile_forms
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import poses
from rislam_rt.slam.window.solver_limits import MOST, NEAR, STRENGTHS
from rislam_rt.slam.window.state import WindowState


class MapExplanation(NamedTuple):
    """Explanation of one track by one cluster of predicted returns."""

    track: int
    """Row of the track's summary."""
    log_evidence: float
    """Log evidence, whatever of the cluster is heard."""
    forms: Integers
    """(2, 5) forms of feature rows: of the leading return, and of its partner if that is heard with it."""
    share: float
    """Weight of the partner in the component's place."""


def explanations(
    context: WindowState, rows: Integers, histories: TrackSummary, owner: Integers, view: CycleAssociation,
    mean: Floats, covariance: Floats,
) -> list[MapExplanation]:  # fmt: skip
    """Explanations of tracks, `rows` (T,) of all, by predicted returns of the map; `owner` (E,) is the track of each of
    the histories."""
    expected, groups = view.expected, view.groups
    if not len(groups.leader):
        return []
    lead, share = expected.seen[groups.leader], groups.share[:, None]
    inside, wide = covariance[HEAD:, HEAD:], 1e-14 * np.eye(len(mean) - HEAD)
    root = np.asarray(np.linalg.cholesky(inside + 1e-9 * np.diag(np.diag(inside)) + wide), dtype=np.float64)
    found: list[MapExplanation] = []
    ends = np.bincount(owner)[owner]
    for row, track in enumerate(owner.tolist()):
        seen = context.tracks.mean[rows[track], :, 0] if ends[row] == 1 else _latest(histories, row, context)
        off = np.abs(lead + share * groups.gap - seen) / NEAR
        near = (off < 1.0).all(axis=1).nonzero()[0]
        for column in near[np.argsort(off[near].sum(axis=1))][:MOST].tolist():
            one = _explanation(context, histories, row, view, column, mean[HEAD:].reshape(-1, 3), root)
            found.append(one._replace(track=track, log_evidence=one.log_evidence - float(np.log(ends[row]))))
    return found


def _latest(histories: TrackSummary, row: int, context: WindowState) -> Floats:
    """Length and cosines (3,) of a track's last normal point, in the body frame."""
    last = int((histories.weight[row, :, 0] > 0.0).sum()) - 1
    turn = rotation_z(np.array(-float(context.heading[-1] + poses(context.window)[-1, 3])))[:2, :2]
    return np.append(histories.seen[row, last, 0], turn @ histories.seen[row, last, 1:])


def _explanation(
    context: WindowState, histories: TrackSummary, row: int, view: CycleAssociation, column: int, features: Floats,
    root: Floats,
) -> MapExplanation:  # fmt: skip
    """Explanation of a track's history by one cluster of returns: all of it, or its leading return alone."""
    groups, lead, mate = view.groups, int(view.groups.leader[column]), int(view.groups.partner[column])
    parts = view.expected.forms[[lead] if mate < 0 else [lead, mate]]
    history = _predicted(context, histories, row, parts, features, root)
    around, gap = groups.disturbance[column], groups.gap[column]
    nobody = np.full(5, UNKNOWN)
    level, doubt = (field[lead] for field in (view.expected.log_amplitude, view.expected.log_amplitude_std))
    if mate < 0:
        value = _log_evidence(history, np.ones(1), around) + _log_level(histories, row, level, doubt)
        return MapExplanation(row, value, np.stack([parts[0], nobody]), 0.0)
    heard = float(np.clip(view.clear[mate] * view.above[mate], CONSTANTS.rare, 1.0 - CONSTANTS.rare))
    share, variance = float(groups.share[column]), groups.share_variance[column]
    both = _log_evidence(history, np.array([1.0 - share, share]), around + variance * gap**2)
    both += _log_level(histories, row, groups.log_amplitude[column], groups.log_amplitude_std[column])
    alone = _log_evidence(history, np.array([1.0, 0.0]), around) + _log_level(histories, row, level, doubt)
    both, alone = both + np.log(heard), alone + np.log1p(-heard)
    value = float(np.logaddexp(both, alone))
    if alone > both:
        return MapExplanation(row, value, np.stack([parts[0], nobody]), 0.0)
    return MapExplanation(row, value, parts, share)


class _Predicted(NamedTuple):
    """History of a track against up to two predicted returns, R of them, at its B normal points."""

    left: Floats
    """(B, R, 3) measured less predicted length and cosines."""
    slopes: Floats
    """(B, R, 3, N) of the predictions, by unknowns of unit variance: errors of poses and map."""
    reported: Floats
    """(B, 3) standard deviations of the normal points."""


def _predicted(
    context: WindowState, histories: TrackSummary, row: int, parts: Integers, features: Floats, root: Floats
) -> _Predicted:
    """History of a track against the returns of forms `parts` (R, 5)."""
    nearest, used = context.scene.sensor.nearest, histories.weight[row, :, 0] > 0.0
    poses = Poses(histories.tx[row, used], histories.rx[row, used], np.zeros(int(used.sum())))
    linear = linearise(compile_forms(parts), features, context.landmarks.anchor, poses)
    linear.seen[..., 0] = linear.seen[..., :1, 0] + nearest(linear.seen[..., 0] - linear.seen[..., :1, 0])
    uncertainty, twist = histories.uncertainty[row, used], histories.twist[row, used]
    twist = np.broadcast_to(twist[:, None], (*linear.seen.shape, twist.shape[-1]))
    slopes = np.concatenate([linear.by_pose @ uncertainty[:, None], twist, linear.wide @ root], axis=-1)
    left = histories.seen[row, used][:, None] - linear.seen
    left[..., 0] = nearest(left[..., 0])
    return _Predicted(left, slopes, histories.weight[row, used] ** -1.0)


def _log_evidence(history: _Predicted, share: Floats, extra: Floats) -> float:
    """Log evidence of an explanation by the map: of a history as returns of weights `share` (R,), which company moves
    by a variance of up to `extra` (3,); its logarithm is anything alike from nothing to that, as for any neighbour
    (`expected_scatter`)."""
    whole = np.log1p(extra / history.reported**2)
    strength = np.linspace(0.0, 1.0, STRENGTHS) if extra.any() else np.zeros(1)
    factor = np.exp(0.5 * strength[:, None, None] * whole)  # on the reported deviations
    left = np.einsum("r,bri->bi", share, history.left) / (history.reported * factor)
    slopes = np.einsum("r,brin->bin", share, history.slopes) / history.reported[..., None]
    flat = slopes.reshape(-1, slopes.shape[-1])
    if flat.shape[1] > flat.shape[0]:
        flat = np.asarray(np.linalg.qr(flat.T, mode="r")).T
    cost = _costs(left, flat / factor.reshape(len(strength), -1, 1)) + 2.0 * np.log(factor).sum(axis=(1, 2))
    return float(np.logaddexp.reduce(-0.5 * cost) - np.log(len(strength)))


def _costs(left: Floats, slopes: Floats) -> Floats:
    """Costs (S,), -2 log evidence, of explanations by the map that leave residuals (S, B, 3) in deviations, with slopes
    (S, 3B, N) by unknowns of unit variance: Student's t, by reweighting."""
    trust = np.ones(left.shape[:2])
    for _ in range(2):
        heavy = slopes * np.repeat(trust, 3, axis=1)[..., None]
        normal = np.swapaxes(heavy, 1, 2) @ slopes + np.eye(slopes.shape[2])
        error = np.linalg.solve(normal, np.swapaxes(heavy, 1, 2) @ left.reshape(len(left), -1, 1))
        rest = left - (slopes @ error).reshape(left.shape)
        squared = np.vecdot(rest, rest)
        trust = (CONSTANTS.tail + 3.0) / (CONSTANTS.tail + squared)
    cost = (CONSTANTS.tail + 3.0) * np.log1p(squared / CONSTANTS.tail).sum(axis=1) + (error**2).sum(axis=(1, 2))
    return np.asarray(cost + np.linalg.slogdet(normal)[1])


def _log_level(histories: TrackSummary, row: int, log_amplitude: float, std: float) -> float:
    """Log density of a track's mean log amplitude, predicted within `std`."""
    level, variance = histories.log_amplitude[row] - log_amplitude, std**2 + CONSTANTS.fading**2
    return float(-0.5 * (level**2 / variance + np.log(variance)))
