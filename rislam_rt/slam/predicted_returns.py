"""Predicted returns of the map's features: path lengths and direction cosines, and their derivatives by map and pose.

The map is a list of features of three numbers each. A point is its position. A wall is the mirror image of a fixed
anchor (a point of the agent's own choosing, off the wall): as smooth and as Gaussian as a point landmark, and never
singular. A leg is an image of a point in up to two walls; a return joins a Tx leg and an Rx leg, so that
`length = |Tx - image_tx| + |Rx - image_rx|` and the ray arrives from `image_rx`.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body

TX = -1
"""In the first column of `Returns.legs`: the base of the leg is the transmitter itself."""
NONE = -1
"""In the wall columns of `Returns.legs`: no wall."""
AXES = np.eye(3)
"""Unit vectors of the three axes: the identity matrix."""


class Returns(NamedTuple):
    """R paths (returns) over the map's features, each of a Tx leg and an Rx leg among G legs."""

    legs: Integers
    """Feature rows (G, 3) of each leg's point (or `TX`), of the wall next to it, and of the wall next to the device."""
    tx: Integers
    """Row (R,) of each return's Tx leg."""
    rx: Integers
    """Row (R,) of each return's Rx leg."""

    @property
    def point(self) -> Integers:
        """Feature row (R,) of each return's point."""
        return self.legs[self.rx, 0]


class PredictedReturn(NamedTuple):
    """Predicted length and direction of R returns, as seen from the agent's poses."""

    seen: Floats
    """Lengths [m] and the two direction cosines in the body frame (..., R, 3)."""
    tx_length: Floats
    """Unfolded lengths (..., R) [m] of the Tx legs."""
    rx_length: Floats
    """Unfolded lengths (..., R) [m] of the Rx legs."""
    up: Floats
    """Third direction cosine (..., R) of the arrival; the array is blind where it is negative."""


class Poses(NamedTuple):
    """Positions of the agent's Tx and Rx, and its heading."""

    tx: Floats
    """Positions (..., 3) [m] of the Tx."""
    rx: Floats
    """Positions (..., 3) [m] of the Rx array's centre."""
    heading: Floats
    """Headings [rad], which broadcast against the leading axes."""


def poses_of(position: Floats, heading: Floats, body: Body) -> Poses:
    """Tx and Rx for predicted returns, of agents at positions (..., 3) [m], with headings [rad] that broadcast against
    the leading axes."""
    return Poses(*body.ends(position, heading), np.asarray(heading))


def reflect(point: Floats, wall: Floats, anchor: Floats) -> Floats:
    """Mirror images (..., 3) of points in walls, to predict returns; walls are given as images (..., 3) of their
    anchors (..., 3)."""
    span = wall - anchor
    depth = np.vecdot(span, point - 0.5 * (wall + anchor)) / np.vecdot(span, span)
    return point - 2.0 * depth[..., None] * span


def by_wall(point: Floats, wall: Floats, anchor: Floats) -> Floats:
    """Derivatives (..., 3, 3) of mirror images of points (..., 3) by the walls (..., 3), for predicted returns."""
    span = wall - anchor
    scaled = span / np.vecdot(span, span)[..., None]
    depth = np.vecdot(scaled, point - 0.5 * (wall + anchor))[..., None]
    mirrored = point - 2.0 * depth * span
    return np.asarray(-2.0 * (depth[..., None] * AXES + scaled[..., :, None] * (mirrored - wall)[..., None, :]))


def bounced(legs: Integers, column: int) -> tuple[Integers, Integers]:
    """Rows of the predicted returns' legs (G, 3) that bounce off a wall in column 1 or 2, and the feature rows of those
    walls."""
    rows = (legs[:, column] != NONE).nonzero()[0]
    return rows, legs[rows, column]


def leg_images(returns: Returns, features: Floats, anchor: Floats, tx: Floats) -> Floats:
    """Mirror images (..., G, 3) [m] of the points of predicted returns' legs in their walls, from features (..., F, 3)
    and Tx (..., 3)."""
    legs = returns.legs
    moving, base = legs[:, 0] == TX, features.take(legs[:, 0], axis=-2)
    if moving.any():  # only then do images differ from pose to pose
        base = np.where(moving[:, None], tx[..., None, :], base)
    for column in (1, 2):
        rows, walls = bounced(legs, column)
        if len(rows):
            base[..., rows, :] = reflect(base.take(rows, axis=-2), features.take(walls, axis=-2), anchor[walls])
    return base


def observe(returns: Returns, features: Floats, anchor: Floats, poses: Poses) -> PredictedReturn:
    """Predicted lengths and direction cosines of all returns from the map's features (..., F, 3) and agent's poses."""
    image = leg_images(returns, features, anchor, poses.tx)
    # leg by leg, as many returns share one
    tx_length = _norm(image - poses.tx[..., None, :]).take(returns.tx, axis=-1)
    to_rx = image - poses.rx[..., None, :]
    rx_length = np.maximum(_norm(to_rx), 1e-9)
    arrival = to_rx / rx_length[..., None]
    cos, sin = np.cos(poses.heading)[..., None], np.sin(poses.heading)[..., None]
    by_leg = np.empty(arrival.shape)
    by_leg[..., 0] = rx_length
    by_leg[..., 1] = arrival[..., 0] * cos + arrival[..., 1] * sin
    by_leg[..., 2] = arrival[..., 1] * cos - arrival[..., 0] * sin
    seen = by_leg.take(returns.rx, axis=-2)
    seen[..., 0] += tx_length
    return PredictedReturn(
        seen, tx_length, rx_length.take(returns.rx, axis=-1), arrival[..., 2].take(returns.rx, axis=-1)
    )


class Linear(NamedTuple):
    """Predicted returns and their derivatives with respect to the map's features and the agent's pose."""

    seen: Floats
    """Lengths [m] and direction cosines (..., R, 3)."""
    wide: Floats
    """Derivatives (..., R, 3, S + 3F) with respect to the features, behind S spare columns of zeros."""
    by_tx: Floats
    """Derivatives (..., R, 3, 3) with respect to the position of the Tx."""
    by_rx: Floats
    """Derivatives (..., R, 3, 3) with respect to the position of the Rx."""

    @property
    def by_feature(self) -> Floats:
        """Derivatives (..., R, 3, F, 3) of returns with respect to the features, where no column is spare."""
        return self.wide.reshape(*self.seen.shape, self.wide.shape[-1] // 3, 3)

    @property
    def by_pose(self) -> Floats:
        """Derivatives (..., R, 3, 3) of returns with respect to the agent's position, which moves both ends."""
        return self.by_tx + self.by_rx

    def by_heading(self, poses: Poses, position: Floats) -> Floats:
        """Derivatives (..., R, 3) of returns with respect to the heading, which turns Tx, Rx, array about
        `position`."""
        turned = np.zeros(self.seen.shape)
        turned[..., 1], turned[..., 2] = self.seen[..., 2], -self.seen[..., 1]
        for jacobian, end in ((self.by_tx, poses.tx), (self.by_rx, poses.rx)):
            arm = end - position
            arm = arm if arm.ndim == turned.ndim else arm[..., None, :]
            turned += jacobian[..., 1] * arm[..., None, 0] - jacobian[..., 0] * arm[..., None, 1]
        return turned


def linearise(returns: Returns, features: Floats, anchor: Floats, poses: Poses, spare: int = 0) -> Linear:
    """Predicted returns with their derivatives with respect to features (..., F, 3) and the positions of Tx and Rx."""
    ends = Poses(poses.tx[..., None, :], poses.rx[..., None, :], np.asarray(poses.heading)[..., None])
    return _linearise(returns, features, anchor, ends.tx, ends, spare)


def linearise_each(returns: Returns, features: Floats, anchor: Floats, poses: Poses, spare: int = 0) -> Linear:
    """Predicted returns with derivatives as by `linearise`, each return as seen from a pose of its own.

    Returns that share a leg which begins at the Tx itself (`TX`) must share the Tx's position.
    """
    return _linearise(returns, features, anchor, _tx_of_legs(returns, poses), poses, spare)


def observe_each(returns: Returns, features: Floats, anchor: Floats, poses: Poses) -> Floats:
    """Predicted lengths and cosines (R, 3) of returns, each as seen from a pose of its own, as by `linearise_each`."""
    image = _mirrored(returns.legs, features, anchor, _tx_of_legs(returns, poses))[0]
    return _arrivals(image, returns, poses).seen


def _tx_of_legs(returns: Returns, poses: Poses) -> Floats:
    """Positions (G, 3) of the Tx at the legs of predicted returns that have a pose (R,) each."""
    tx = np.empty((len(returns.legs), 3))
    tx[returns.tx] = tx[returns.rx] = poses.tx
    return tx


def _linearise(returns: Returns, features: Floats, anchor: Floats, leg_tx: Floats, poses: Poses, spare: int) -> Linear:
    """Predicted returns with derivatives, by the Tx of each leg (..., G or 1, 3) and poses (..., R or 1) of returns."""
    image, bounces = _mirrored(returns.legs, features, anchor, leg_tx)
    found, count = _arrivals(image, returns, poses), features.shape[-2]
    seen, by_tx, by_rx = found.seen, found.by_tx, _by_image(found, poses.heading)
    wide = np.zeros((*seen.shape, spare + 3 * count))
    block = np.swapaxes(wide[..., spare:].reshape(*seen.shape, count, 3), -3, -2)
    moving = returns.point == TX  # the Tx leg of a moving base is the Tx itself
    parts, by_base = _back(returns.legs, returns.rx, bounces, by_rx.copy())
    for rows, feature, slopes in parts:
        block[..., rows, feature, :, :] = slopes
    still = (~moving).nonzero()[0]
    if len(still):
        toward = by_tx.take(still, axis=-2)[..., None, :]
        for rows, feature, slopes in _back(returns.legs, returns.tx[still], bounces, toward)[0]:
            block[..., still[rows], feature, 0, :] += slopes[..., 0, :]
    # the images of a moving base move with it
    tx_jacobian = np.where(moving[:, None, None], by_base, 0.0)
    tx_jacobian[..., 0, :] -= by_tx
    return Linear(seen, wide, tx_jacobian, -by_rx)


class _Arrivals(NamedTuple):
    """Lengths and cosines (..., R, 3) of predicted returns, unit vectors (..., R, 3) from Tx and Rx to what they see of
    them, and the Rx legs' lengths (..., R)."""

    seen: Floats
    by_tx: Floats
    arrival: Floats
    rx_length: Floats


def _arrivals(image: Floats, returns: Returns, poses: Poses) -> _Arrivals:
    """What is seen of predicted returns from poses (..., R or 1), of images (..., G, 3) of their legs' points."""
    to_tx, to_rx = image.take(returns.tx, axis=-2) - poses.tx, image.take(returns.rx, axis=-2) - poses.rx
    tx_length, rx_length = _norm(to_tx), np.maximum(_norm(to_rx), 1e-9)
    by_tx, arrival = to_tx / np.maximum(tx_length, 1e-9)[..., None], to_rx / rx_length[..., None]
    cos, sin, seen = np.cos(poses.heading), np.sin(poses.heading), np.empty(arrival.shape)
    seen[..., 0] = tx_length + rx_length
    seen[..., 1] = arrival[..., 0] * cos + arrival[..., 1] * sin
    seen[..., 2] = arrival[..., 1] * cos - arrival[..., 0] * sin
    return _Arrivals(seen, by_tx, arrival, rx_length)


def _by_image(rays: _Arrivals, heading: Floats) -> Floats:
    """Derivatives (..., R, 3, 3) of predicted lengths and cosines by the images that the Rx sees."""
    cos, sin, found = np.cos(heading), np.sin(heading), rays.seen[..., None] * -rays.arrival[..., None, :]
    found[..., 1, 0] += cos
    found[..., 1, 1] += sin
    found[..., 2, 0] -= sin
    found[..., 2, 1] += cos
    found /= rays.rx_length[..., None, None]
    found[..., 0, :] = rays.arrival
    return found


class _Bounces(NamedTuple):
    """Bounces of N of G legs off the wall that is next to the base, or next to the device, in predicted returns."""

    place: Integers
    """(G,) row of each leg's bounce, -1 where it has none."""
    wall: Integers
    """(N,) feature row of the wall."""
    span: Floats
    """(..., N, 3) from the wall's anchor to its image, along the normal..."""
    scaled: Floats
    """(..., N, 3) ...the same over its square..."""
    depth: Floats
    """(..., N) ...and what is mirrored from the wall along it."""
    out: Floats
    """(..., N, 3) from the anchor's image to that of what is mirrored."""


def _mirrored(legs: Integers, features: Floats, anchor: Floats, tx: Floats) -> tuple[Floats, list[_Bounces]]:
    """Mirror images (..., G, 3) of the points of predicted returns' legs, and the bounces off their walls, base first;
    `tx` (..., G or 1, 3) is the Tx."""
    moving, image, found = legs[:, 0] == TX, features.take(legs[:, 0], axis=-2), []
    if moving.any():  # only then do images differ from pose to pose
        image = np.where(moving[:, None], tx, image)
    for column in (1, 2):
        rows, walls = bounced(legs, column)
        if not len(rows):
            continue
        wall, base, start = features.take(walls, axis=-2), anchor[walls], image.take(rows, axis=-2)
        span, place = wall - base, np.full(len(legs), -1)
        scaled, place[rows] = span / np.vecdot(span, span)[..., None], np.arange(len(rows))
        depth = np.vecdot(scaled, start - 0.5 * (wall + base))
        mirrored = start - 2.0 * depth[..., None] * span
        image[..., rows, :] = mirrored
        found.append(_Bounces(place, walls, span, scaled, depth, mirrored - wall))
    return image, found


def _back(
    legs: Integers, leg: Integers, bounces: list[_Bounces], slopes: Floats
) -> tuple[list[tuple[Integers, Integers, Floats]], Floats]:
    """Carry slopes (..., N, M, 3) of predicted returns by the images of legs `leg` (N,) back to the bases (..., N, M,
    3), in place, from wall to wall (chain rule); returns as well those by features: which of the returns, feature
    rows, slopes."""
    found = []
    for each in bounces[::-1]:
        at = each.place[leg]
        rows = (at >= 0).nonzero()[0]
        own, at = slopes.take(rows, axis=-3), at[rows]
        span, scaled, out = (side.take(at, axis=-2)[..., None, :] for side in (each.span, each.scaled, each.out))
        turned = each.depth.take(at, axis=-1)[..., None, None] * own + np.vecdot(own, scaled)[..., None] * out
        found.append((rows, each.wall[at], -2.0 * turned))
        slopes[..., rows, :, :] = own - 2.0 * np.vecdot(own, span)[..., None] * scaled
    point = legs[leg, 0]
    rows = (point >= 0).nonzero()[0]
    return [*found, (rows, point[rows], slopes.take(rows, axis=-3))], slopes


def compact(returns: Returns, rows: Integers) -> Returns:
    """Some of the predicted returns, by row, with only the legs that they need."""
    tx, rx = returns.tx[rows], returns.rx[rows]
    used = np.zeros(len(returns.legs), dtype=np.bool_)
    used[tx] = used[rx] = True
    place = np.cumsum(used) - 1
    return Returns(returns.legs[used], place[tx], place[rx])


def _norm(vector: Floats) -> Floats:
    """Lengths (...,) of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.vecdot(vector, vector)))
