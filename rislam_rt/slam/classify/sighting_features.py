"""Features of a track that tell its kind of path: strength, fading, direction, change with the agent's own motion.

To first order, over a displacement d of the agent, the direction cosines h of a path that comes from a fixed point at
distance 1/q turn by `-q P d`, P the projection across h; its length changes by `-a h . d`. For a scatterer
q = 2/length and a = 2; for its images and their reciprocals both differ; for one wall's return q = 0 and a = 2 (the
image moves along with the agent). A wall and a level ceiling turn a path as a point does along its own azimuth, and
not across it. Two upright walls at right angles are a corner reflector: a point but for its strength, for its place on
the horizon, and for being where the returns of both walls say (`echo_misfit`). Images of a point are where its own path
and the walls' returns say (`image_misfit`). Nothing here needs a map or the truth.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, RadioConfig
from rislam_rt.ris.path_gain import image_amplitude
from rislam_rt.slam.classify.echo_misfit import echo_misfit
from rislam_rt.slam.classify.image_misfit import image_misfit

FEATURES = (
    "strength", "fading", "snr", "length", "elevation", "arrival_std", "turn", "turn_std", "turn_along",
    "turn_along_std", "approach", "approach_std", "misfit_static", "misfit_moving", "echo_misfit", "echo_strength",
    "image_misfit", "image_strength", "mirror", "age",
)  # fmt: skip
"""Names of the columns of `track_features`, in their order."""
STD_SCALE = 1.5
"""By how much true errors exceed the reported standard deviations: unresolved neighbours pull at a component."""
LENGTH_FLOOR, COSINE_FLOOR = 0.01, 0.01
"""Least standard deviations [m] and of a cosine: what the first order in the motion leaves out."""
TURN_PRIOR, APPROACH_PRIOR = (0.5, 0.7), (1.5, 1.0)
"""Prior mean and standard deviation of `q length / 2` and of `a`."""
FADING_FLOOR = 0.05
"""Fading (standard deviation of the log amplitude) that cannot be told from none."""


class Sightings(NamedTuple):
    """Measurements of T tracks in the last W cycles, the latest last, and the poses from which the agent made them."""

    seen: Floats
    """Lengths [m] and two cosines in the body frame (T, W, 3)."""
    std: Floats
    """Standard deviations (T, W, 3) of lengths and cosines."""
    log_amplitude: Floats
    """Log amplitudes (T, W)."""
    held: Booleans
    """Whether (T, W) there was a measurement; the other entries mean nothing."""
    position: Floats
    """Positions (W, 3) [m] of the agent, as it estimates them."""
    heading: Floats
    """Headings (W,) [rad] of the agent."""


class MotionFit(NamedTuple):
    """Fit of how direction and length of T tracks change with the agent's motion, (T,) each."""

    turn: Floats
    """Turn across the path's azimuth, q times half the length: 1 for a scatterer, 0 for one wall."""
    turn_std: Floats
    """Standard deviation of that turn."""
    turn_along: Floats
    """Turn along the path's azimuth, q times half the length."""
    turn_along_std: Floats
    """Standard deviation of that turn."""
    approach: Floats
    """Approach a, the change of length: 2 for a scatterer and for one wall's return."""
    approach_std: Floats
    """Standard deviation of the approach."""
    misfit_static: Floats
    """Mean squared residual, in standard deviations, of a scatterer (turns 1, approach 2)."""
    misfit_moving: Floats
    """Mean squared residual, in standard deviations, of one wall's return (turns 0, approach 2)."""
    height: Floats
    """Third cosine of the arrival."""
    arrival_std: Floats
    """Standard deviation of the mean cosines."""


def track_features(sightings: Sightings, body: Body, radio: RadioConfig) -> Floats:
    """Features (T, 20) of tracks, by `FEATURES`, for their classification; every track needs one measurement at least.

    The tracks should be all that the agent holds at a time: some features relate them to each other.
    """
    held = sightings.held
    count = held.sum(axis=1)
    length = np.maximum(_mean(sightings.seen[..., 0], held), 1e-3)
    log_free = np.log(image_amplitude(np.ones(()), radio))
    level = np.where(held, sightings.log_amplitude, 0.0)
    log_power = np.log(np.maximum(_mean(np.exp(2.0 * level), held), 1e-300))
    noise = _mean(0.5 / np.maximum(radio.integrated_snr(np.exp(level)), 0.5), held)
    fading = _mean((level - _mean(level, held)[:, None]) ** 2, held) - noise * (1.0 - 1.0 / count)
    strength = 0.5 * log_power - log_free + np.log(length)
    fit = fit_motion(sightings)
    offset = rotation_z(sightings.heading[-1]) @ (body.tx_offset - body.rx_offset)
    seen, std = _latest(sightings)
    echo = echo_misfit(seen, std, strength, offset)
    still = stillness(fit.turn, fit.turn_std, fit.approach, fit.approach_std)
    image = image_misfit(seen, std, strength, offset, still, echo.misfit)
    columns = [
        strength,
        0.5 * np.log(np.maximum(fading, 0.0) + FADING_FLOOR**2),
        np.log(np.maximum(radio.integrated_snr(np.exp(0.5 * log_power)), 1e-3)),
        np.log(length),
        fit.height,
        np.log(fit.arrival_std),
        fit.turn,
        np.log(fit.turn_std),
        fit.turn_along,
        np.log(fit.turn_along_std),
        fit.approach,
        np.log(fit.approach_std),
        np.log1p(fit.misfit_static),
        np.log1p(fit.misfit_moving),
        np.log1p(echo.misfit),
        echo.strength,
        np.log1p(image.misfit),
        image.strength,
        image.mirror,
        np.log(count),
    ]
    return np.stack(columns, axis=1)


def fit_motion(sightings: Sightings) -> MotionFit:
    """Least-squares fit of tracks' turn and approach to the agent's motion, and how well the two simple cases fit."""
    held, seen = sightings.held, sightings.seen
    std = np.maximum(STD_SCALE * sightings.std, [LENGTH_FLOOR, COSINE_FLOOR, COSINE_FLOOR])
    weight = np.where(held[..., None], 1.0 / std**2, 0.0)
    body = rotation_z(sightings.heading)[:, :2, :2]
    distance = 0.5 * np.maximum(_mean(seen[..., 0], held), 1e-3)
    arrival = _mean(np.einsum("kij,tkj->tki", body, seen[..., 1:]), held)
    size = np.linalg.norm(arrival, axis=1, keepdims=True)
    arrival /= np.maximum(size, 1.0)
    height = np.sqrt(np.clip(1.0 - np.sum(arrival**2, axis=1), 0.0, 1.0))
    way = sightings.position[None] - _mean(sightings.position[None], held)[:, None]
    towards = np.einsum("tki,ti->tk", way[..., :2], arrival) + way[..., 2] * height[:, None]
    turned = -(way[..., :2] - towards[..., None] * arrival[:, None]) / distance[:, None, None]
    azimuth = arrival / np.maximum(np.linalg.norm(arrival, axis=1, keepdims=True), 1e-12)
    along = np.einsum("tki,ti->tk", turned, azimuth)[..., None] * azimuth[:, None]
    into_body = np.swapaxes(body, 1, 2)
    level = np.broadcast_to(into_body, (*held.shape, 2, 2))
    by_turn = np.stack([np.einsum("kij,tkj->tki", into_body, part) for part in (turned - along, along)], axis=-1)
    turn = _fit_turns(seen[..., 1:], weight[..., 1:], level, by_turn)
    # a second-order term: a point passed by comes nearer and goes again, a wall does not
    bulge = (np.sum(way**2, axis=-1) - towards**2) / distance[:, None]
    approach = _fit_approach(seen[..., 0], weight[..., 0], -towards, bulge)
    count = 3.0 * held.sum(axis=1)
    return MotionFit(
        turn.value[:, 0], turn.std[:, 0], turn.value[:, 1], turn.std[:, 1], approach.value[:, 0], approach.std[:, 0],
        (turn.static + approach.static) / count, (turn.moving + approach.moving) / count, height,
        1.0 / np.sqrt(0.5 * np.sum(weight[..., 1:], axis=(1, 2))),
    )  # fmt: skip


class _Fitted(NamedTuple):
    """Fitted P parameters of T tracks, and the squared residuals (T,) of the two simple cases."""

    value: Floats
    """Fitted parameters (T, P)."""
    std: Floats
    """Standard deviations (T, P) of the parameters."""
    static: Floats
    """Squared residuals (T,) of a scatterer."""
    moving: Floats
    """Squared residuals (T,) of one wall's return."""


def _fit_turns(seen: Floats, weight: Floats, level: Floats, by_turn: Floats) -> _Fitted:
    """Sighting feature of tracks: least-squares turns of their directions; `level` (T, W, 2, 2) brings free mean
    cosines to the body frame."""
    root = np.sqrt(weight)
    columns = np.concatenate([level, by_turn, seen[..., None]], axis=-1) * root[..., None]
    gram = np.einsum("tkia,tkib->tab", columns, columns)
    inner = gram[:, :2, :2] + 1e-9 * np.eye(2)
    # the mean cosines eliminated: what is left of (turns, seen)
    left = gram[:, 2:, 2:] - np.swapaxes(gram[:, :2, 2:], 1, 2) @ np.linalg.solve(inner, gram[:, :2, 2:])
    mean, spread = TURN_PRIOR
    information = left[:, :2, :2] + np.eye(2) / spread**2
    value = np.linalg.solve(information, left[:, :2, 2:] + mean / spread**2)[..., 0]
    std = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    static = left[:, 2, 2] - 2.0 * left[:, :2, 2].sum(axis=1) + left[:, :2, :2].sum(axis=(1, 2))
    return _Fitted(value, std, np.maximum(static, 0.0), np.maximum(left[:, 2, 2], 0.0))


def _fit_approach(seen: Floats, weight: Floats, towards: Floats, bulge: Floats) -> _Fitted:
    """Feature of tracks: least-squares approach, change of length with the agent's motion; mean lengths are free."""
    total = np.maximum(weight.sum(axis=1), 1e-300)
    x, y, z = (v - (np.sum(weight * v, axis=1) / total)[:, None] for v in (towards, seen, bulge))
    mean, spread = APPROACH_PRIOR
    information = np.sum(weight * x * x, axis=1) + 1.0 / spread**2
    value = (np.sum(weight * x * y, axis=1) + mean / spread**2) / information
    static = np.sum(weight * (y - 2.0 * x - z) ** 2, axis=1)
    moving = np.sum(weight * (y - 2.0 * x) ** 2, axis=1)
    return _Fitted(value[:, None], 1.0 / np.sqrt(information)[:, None], static, moving)


def _latest(sightings: Sightings) -> tuple[Floats, Floats]:
    """Latest sighting (T, 3) of each track as a feature, cosines in room axes, and its standard deviations (T, 3)."""
    last = sightings.held.shape[1] - 1 - np.argmax(sightings.held[:, ::-1], axis=1)
    rows = np.arange(len(last))
    seen, std = sightings.seen[rows, last], sightings.std[rows, last]
    turned = np.einsum("tij,tj->ti", rotation_z(sightings.heading[last])[:, :2, :2], seen[:, 1:])
    return np.concatenate([seen[:, :1], turned], axis=1), std


def _mean(values: Floats, held: Booleans) -> Floats:
    """Mean (T, ...), for a track's features, over the cycles of its sightings, of values (T or 1, W, ...)."""
    share = held / np.maximum(held.sum(axis=1, keepdims=True), 1)
    return np.einsum("tk,tk...->t...", share, np.broadcast_to(values, (*held.shape, *values.shape[2:])))


def stillness(turn: Floats, turn_std: Floats, approach: Floats, approach_std: Floats) -> Floats:
    """Feature of a track's sightings: probability (M,) that it is a static point's, not a wall's, from fitted turn and
    approach; equal priors.

    Each likelihood is Gaussian in the fitted turn and approach. A wall has turn 0 and approach 2 (0 for a pair of
    opposite walls); a landmark's path, images included, a turn of 1 with a spread of 0.35 and an approach of 1.8 with
    a spread of 0.3.
    """
    static = _log_normal(turn - 1.0, np.hypot(turn_std, 0.35)) + _log_normal(
        approach - 1.8, np.hypot(approach_std, 0.3)
    )
    wall = _log_normal(turn, np.hypot(turn_std, 0.1))
    wall += np.logaddexp(*(_log_normal(approach - a, np.hypot(approach_std, 0.1)) for a in (2.0, 0.0))) - np.log(2.0)
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * (static - wall))))


def _log_normal(miss: Floats, std: Floats) -> Floats:
    """Log density of a normal, without its constant, for features of sightings."""
    return np.asarray(-0.5 * (miss / std) ** 2 - np.log(std))
