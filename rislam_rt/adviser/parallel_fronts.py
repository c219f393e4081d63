"""Parallel fronts: surfaces that hang a little way before others, and whose returns take over from theirs.

A board before a wall, a door in its frame or cupboards in a row throw signals back from the same direction. Where the
return of one ends and that of the other begins, its length changes as if the agent had stepped aside.
"""

from collections.abc import Iterator

import numpy as np

from rislam_rt.adviser.cancelled_returns import single_returns
from rislam_rt.adviser.link_budget import Survey
from rislam_rt.channel.walls import build_walls
from rislam_rt.input_messages import counted
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.scene.findings import Finding, warning_at

LEAST, SWERVE = 0.005, 0.125
"""Distances [m] between two fronts from which and up to which one is taken for the other, to an agent's harm: a wall is
known to millimetres, and in half a second an agent gets aside so far, at 1 m/s^2."""
PARALLEL = np.deg2rad(1.0)
"""Angle [rad] up to which two fronts are parallel: their returns come from directions closer than an array tells."""


def parallel_front_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of parallel fronts that one may take for each other, the farthest apart: walls from
    `LEAST` to `SWERVE` apart that are heard along the way from the same side; `file` is what it names as its place."""
    paths, settings, walls = looked.paths, looked.settings, build_walls(looked.scene)
    single = single_returns(paths)
    if not settings.slam.use_vt or not len(single):
        return
    heard = audible_paths(paths, settings, use_vt=True)[:, single]
    single, heard = single[heard.any(axis=0)], heard[:, heard.any(axis=0)]
    wall = np.maximum(paths.tx_walls[single].max(axis=1), paths.rx_walls[single].max(axis=1))
    middle = np.array([walls.surface(int(each))[0] for each in wall]).reshape(-1, 3)
    away = looked.scene.agent.position @ walls.normal[wall].T - walls.offset[wall]
    away = np.where(heard, away, 0.0).sum(axis=0) / heard.sum(axis=0)  # where each is heard
    facing = np.sign(away)[:, None] * walls.normal[wall]
    gap = np.abs(np.vecdot(facing[:, None], middle[:, None] - middle))  # of each wall's plane from the others' middles
    alike = (facing @ facing.T > np.cos(PARALLEL)) & (walls.plane[wall][:, None] != walls.plane[wall])
    gap = np.where(alike & (gap >= LEAST) & (gap <= SWERVE), gap, 0.0)
    if not gap.any():
        return
    pair = np.unravel_index(np.argmax(gap), gap.shape)
    nearer = sorted(pair, key=lambda at: -float(facing[at] @ middle[at]))
    front, behind = (f"'{walls.names[wall[at]]}'" for at in nearer)
    apart, others = f"{1e3 * gap[pair]:.0f} mm", int(np.count_nonzero(np.triu(np.maximum(gap, gap.T)))) - 1
    more = f" (and {counted(others, 'other pair')} likewise)" if others else ""
    yield warning_at(
        file, "reflector",
        f"{front} stands {apart} before {behind}{more}, and both are heard along the way: the filter may take one for "
        f"the other, and be {apart} off from there on",
        "where that matters, leave out the one that matters less, or lead the way past one of them alone",
    )  # fmt: skip
