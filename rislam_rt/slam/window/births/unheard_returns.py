"""What it tells of a new wall, found by a path over a known one too, that its own return is not heard."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.arrival_rays import rays
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import free_space
from rislam_rt.slam.returns import poses_of, reflect
from rislam_rt.slam.window.births.hypotheses import Hypotheses
from rislam_rt.slam.window.births.path_feasibility import over_known
from rislam_rt.slam.window.births.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.measurement_prediction import detection_probability
from rislam_rt.slam.window.smoother.window_gaussian import poses
from rislam_rt.slam.window.solver_limits import LEVEL
from rislam_rt.slam.window.state import WindowState

ASIDE = 10.0


def log_unheard(
    context: WindowState, table: Hypotheses, ats: list[Integers], owner: Integers, evidence: Floats, place: Floats,
    spread: Floats, digest: TrackSummary,
) -> Floats:  # fmt: skip
    """(H,) log probability that the new walls of paths over a known wall and a new one, at `place` (H, 3) [m] within
    covariances `spread` (H, 3, 3), are heard by themselves no oftener than they are, in the cycles of the track.

    Something may hide them: the hidden chain of every return (`landmark_update.recall_forms`). A component in the
    return's cell may be it.
    """
    found = np.zeros(len(table.kind))
    track = owner[table.trials.track]
    best = np.full(len(ats), -np.inf)
    np.maximum.at(best, track, evidence)
    rows = (over_known(table) & (evidence > best[track] - ASIDE)).nonzero()[0]
    if not len(rows):
        return found
    log, scene, landmarks = context.log, context.scene, context.landmarks
    where = poses(context.window)
    ends = poses_of(where[:, :3], context.heading + where[:, 3], scene.body)
    first = context.cycle - context.window.num_poses + 1
    slot = log.cycle - first
    heard = rays(log.seen, 0.0)
    cos, sin = np.cos(ends.heading[slot]), np.sin(ends.heading[slot])
    seen = np.stack([log.seen[:, 0], cos * heard[:, 0] - sin * heard[:, 1], sin * heard[:, 0] + cos * heard[:, 1]], 1)
    for row in rows:
        image = reflect(ends.tx, np.broadcast_to(place[row], ends.tx.shape), digest.middle)
        out = image - ends.rx
        length = np.linalg.norm(out, axis=1)
        ray = out / length[:, None]
        # how loud it would be, by what the path over both walls leaves
        both, wall = digest.mean[0][table.trials.track[row], 0], table.known[row]
        doubt = landmarks.ratio_variance[wall] + CONSTANTS.fading**2
        told = digest.log_amplitude[table.trials.track[row]] - free_space(scene.radio) + np.log(both)
        gain = CONSTANTS.wall_ratio_std**2 / (CONSTANTS.wall_ratio_std**2 + doubt)
        ratio = CONSTANTS.wall_ratio + gain * (told - landmarks.ratio[wall] - CONSTANTS.wall_ratio)
        level = free_space(scene.radio) - np.log(length) + ratio
        std = np.full(len(length), np.sqrt(gain * doubt + CONSTANTS.fading**2))
        shows = CONSTANTS.shown * detection_probability(level, std, scene.sensor) * (ray[:, 2] > -LEVEL)
        widest = 2.0 * np.sqrt(np.linalg.eigvalsh(spread[row])[-1])
        gate = scene.sensor.cell_length + widest * np.array([1.0, 1.0 / length[-1], 1.0 / length[-1]])
        off = seen - np.concatenate([length[:, None], ray[:, :2]], axis=1)[slot]
        off[:, 0] = scene.sensor.nearest(off[:, 0])
        present = np.zeros(len(length), dtype=np.bool_)
        present[slot[(np.abs(off) < gate).all(axis=1)]] = True
        mine = slot[ats[track[row]]]
        clear = CONSTANTS.steady**2
        for at in range(mine.min(), mine.max() + 1):
            if present[at]:
                clear = 1.0
            else:
                found[row] += np.log1p(-clear * shows[at])
                clear *= (1.0 - shows[at]) / (1.0 - clear * shows[at])
            clear = clear * (1.0 - CONSTANTS.rare) + (1.0 - clear) * CONSTANTS.cleared
    return found
