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

SWERVE = 0.125
"""Distance [m] between two fronts up to which one is taken for the other: as far as an agent gets aside within half a
second at 1 m/s^2."""
PARALLEL = np.deg2rad(1.0)
"""Angle [rad] up to which two fronts are parallel: their returns come from directions closer than an array tells."""


def parallel_front_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of the parallel fronts farthest apart of those that one may take for each other: walls
    `SWERVE` apart or less that face the agent alike, of which it hears both along its way; `file` is what the warning
    names as its place."""
    paths, settings, walls = looked.paths, looked.settings, build_walls(looked.scene)
    single = single_returns(paths)
    heard = single[audible_paths(paths, settings, use_vt=settings.slam.use_vt)[:, single].any(axis=0)]
    wall = np.unique(np.maximum(paths.tx_walls.max(axis=1), paths.rx_walls.max(axis=1))[heard])
    if not settings.slam.use_vt or len(wall) < 2:
        return
    middle = np.array([walls.surface(int(each))[0] for each in wall])
    away = walls.normal[wall] @ looked.scene.agent.position[0] - walls.offset[wall]
    facing = np.sign(away)[:, None] * walls.normal[wall]
    gap = np.abs(np.vecdot(facing[:, None], middle[:, None] - middle))  # of each wall's plane from the others' middles
    alike = (facing @ facing.T > np.cos(PARALLEL)) & (walls.plane[wall][:, None] != walls.plane[wall])
    gap = np.where(alike & (gap <= SWERVE), gap, 0.0)
    if not gap.any():
        return
    pair = np.unravel_index(np.argmax(gap), gap.shape)
    front, behind = (f"'{walls.names[wall[at]]}'" for at in sorted(pair, key=lambda at: abs(away[at])))
    apart, others = f"{1e3 * gap[pair]:.0f} mm", int(np.count_nonzero(np.triu(np.maximum(gap, gap.T)))) - 1
    more = f" (and {counted(others, 'other pair')} likewise)" if others else ""
    yield warning_at(
        file, "reflector",
        f"{front} stands {apart} before {behind}{more}, and both are heard along the way: the filter may take one for "
        f"the other, and be {apart} off from there on",
        "where that matters, leave out the one that matters less, or lead the way past one of them alone",
    )  # fmt: skip
