"""Frame of the window filter: that of the start's heading as it was told, where its error is not known.

Nothing that is measured tells how the room is turned about the start, no more than where the start was. If the window
estimated it, the cycles that were linearised at different headings would seem to tell of it. So it stands beside the
Gaussian, which holds poses and map in a frame that is turned with the start, and turns them into the room at the end.
Only the velocity that was told in the room tells of that turn, by the velocity that is estimated.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.predicted_returns import AXES
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.smoother.motion_basis import HEAD, last_pose_matrix
from rislam_rt.slam.window.smoother.window_gaussian import Window, mapped


class StartFrame(NamedTuple):
    """Turn of the room against the window's frame, about the start, given the first velocity in that frame."""

    pivot: Floats
    """(3,) [m] the start's position."""
    velocity: Floats
    """(2,) [m/s] horizontal velocity that was told of the start."""
    gain: Floats
    """(2,) [rad s/m] by how much the turn grows with the first velocity; 0 once that has left the window."""
    turn: float
    """[rad] the turn, were the first velocity as it was told."""
    variance: float
    """[rad^2] of the turn, given the first velocity..."""
    prior: float
    """[rad^2] ...and beforehand."""


def no_frame(start: StartPrior) -> StartFrame:
    """Start frame that is the room's."""
    return StartFrame(start.position, start.velocity[:2], np.zeros(2), 0.0, 0.0, 0.0)


def turned_with(start: StartPrior) -> StartFrame:
    """Start frame that is turned with the start's heading: by `heading_std` against the room."""
    velocity, variance = start.velocity[:2], start.heading_std**2
    across = np.array([-velocity[1], velocity[0]])
    known = max(start.velocity_std, 1e-6) ** 2
    share = variance / (known + variance * float(across @ across))
    return StartFrame(start.position, velocity, -share * across, 0.0, share * known, variance)


def with_velocity_turned(window: Window, start: StartPrior) -> Window:
    """Sliding window of one pose and no features whose horizontal velocity is as well known as the start tells of it in
    the frame of its heading."""
    across = np.array([-start.velocity[1], start.velocity[0]])
    spread, information = window.covariance.copy(), window.prior.hessian.copy()
    spread[3:5, 3:5] += start.heading_std**2 * np.outer(across, across)
    information[3:5, 3:5] = np.linalg.inv(spread[3:5, 3:5])
    return window._replace(covariance=spread, prior=window.prior._replace(hessian=information))


def without_velocity(frame: StartFrame) -> StartFrame:
    """Start frame of which the told velocity tells nothing, as that was wrong."""
    return frame._replace(gain=np.zeros(2), turn=0.0, variance=frame.prior)


def with_turn_fixed(frame: StartFrame, window: Window) -> StartFrame:
    """Start frame as the window's first velocity tells of it, before its first pose leaves."""
    if not frame.gain.any():
        return frame
    turn, variance = turn_now(frame, window)
    return frame._replace(gain=np.zeros(2), turn=turn, variance=variance)


def turn_now(frame: StartFrame, window: Window) -> tuple[float, float]:
    """Turn [rad] of the room against the start frame and its variance [rad^2], by the window's first velocity."""
    turn = frame.turn + float(frame.gain @ (window.head[3:5] - frame.velocity))
    return turn, frame.variance + float(frame.gain @ window.covariance[3:5, 3:5] @ frame.gain)


def in_room(frame: StartFrame, window: Window, places: Floats) -> Floats:
    """Places (..., 3) [m] of the start frame, in the room."""
    if not frame.variance:
        return places
    return np.asarray(frame.pivot + (places - frame.pivot) @ rotation_z(np.asarray(turn_now(frame, window)[0])).T)


def present_in_room(
    frame: StartFrame, window: Window, landmarks: WindowTable, mean: Floats, covariance: Floats, *, images: bool = False
) -> tuple[Floats, Floats, WindowTable]:  # fmt: skip
    """Mean (7 + 3F,) and covariance of the present (see `window_gaussian.now`) in the room, turned from the start
    frame, with the landmark table whose anchors are turned likewise.

    The second order of walls' `images` counts where they stand in a Gaussian again; the walls themselves, directions
    and offsets, have none.
    """
    if not frame.variance:
        return mean, covariance, landmarks
    angle, variance = turn_now(frame, window)
    rotation, spin = rotation_z(np.asarray(angle)), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    by, mean = np.eye(len(mean)), mean.copy()
    for first in (0, 3, *range(HEAD, len(mean), 3)):
        by[first : first + 3, first : first + 3] = rotation
    spots = np.concatenate([mean[None, :3], mean[HEAD:].reshape(-1, 3)])
    spots = frame.pivot + (spots - frame.pivot) @ rotation.T
    anchor = frame.pivot + (landmarks.anchor - frame.pivot) @ rotation.T
    velocity = rotation @ mean[3:6]
    span = spots[1:] - anchor
    normal = span / np.maximum(np.linalg.norm(span, axis=1), 1e-9)[:, None]
    mirror = AXES - 2.0 * normal[:, :, None] * normal[:, None, :]
    moved = (spots[1:] - frame.pivot) @ spin.T
    # a wall turns, and its anchor stays
    held = (mirror @ ((anchor - frame.pivot) @ spin.T)[..., None])[..., 0]
    slope = np.concatenate([
        spin @ (spots[0] - frame.pivot), spin @ velocity, [1.0],
        (moved - np.where(landmarks.is_wall[:, None], held, 0.0)).ravel(),
    ])  # fmt: skip
    # to second order an arm is the shorter, the more it is turned, either way: by 1 - cos, of mean square 3/4 std^4
    arms = np.where(landmarks.is_wall[:, None], images * (spots[1:] - anchor), spots[1:] - frame.pivot)
    bow = np.concatenate([spots[0] - frame.pivot, velocity, [0.0], arms.ravel()])
    bow[[2, 5]], bow[HEAD + 2 :: 3] = 0.0, 0.0
    mean[:3], mean[3:6], mean[6], mean[HEAD:] = spots[0], velocity, mean[6] + angle, spots[1:].ravel()
    wide = by @ covariance @ by.T + variance * np.outer(slope, slope) + 0.75 * variance**2 * np.outer(bow, bow)
    if frame.gain.any():  # what the first velocity tells of the turn errs with all else
        shared = np.outer(by @ (_first_velocity_covariance(window) @ frame.gain), slope)
        wide += shared + shared.T
    return mean, wide, landmarks._replace(anchor=anchor)


def _first_velocity_covariance(window: Window) -> Floats:
    """Covariance (7 + 3F, 2) of the present (see `window_gaussian.now`) with the horizontal velocity of the window's
    first pose."""
    along = window.covariance[:, 3:5]
    present = mapped(last_pose_matrix(window.step.tobytes(), window.velocity_turn.tobytes(), window.turns), along)
    return np.concatenate([present, along[HEAD : len(window.head)]])
