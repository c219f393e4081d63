"""Scene check of RIS panels: on their hosts, facing the room, clear of each other, plausible for the radio."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.triangles import triangle_planes
from rislam_rt.model import RadioConfig, RisPanel
from rislam_rt.model.delay_spread import delay_spread_remark
from rislam_rt.scene.check.mesh_queries import ray_hits, touching
from rislam_rt.scene.check.triangle_array import MIN_CLEARANCE, TriangleArray
from rislam_rt.scene.check.units import WIDEST_SPACING, units_that_fit
from rislam_rt.scene.findings import Finding, panel_key

MAX_TURN = 1e-2
"""Largest angle [rad] between the normals of a RIS panel and of its host."""
THICKEST = 0.05
"""Largest distance [m] of a RIS panel before its host: its own thickness and its mount, a board on studs or rails."""


def panel_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of a RIS panel too large, out of bounds, off its host, facing out, or over another panel."""
    for panel, key in _keyed(room):
        yield from _too_large(room, panel, key)
        at = panel.center
        tolerant = room._replace(bounds=room.bounds + MIN_CLEARANCE * np.array([[-1.0], [1.0]]))
        if len(tolerant.outside(at[None])):
            message = f"{at.tolist()} lies outside the meshes' bounds {room.box}"
            yield room.error(f"{key}.center", message, "move the panel onto its host")
            continue
        findings = list(_on_host(room, panel, key))
        yield from findings
        if not findings:
            yield from _facing(room, panel, key)
    for (one, _), (other, key) in combinations(_keyed(room), 2):
        if _overlap(one, other):
            message = f"'{other.name}' covers a part of '{one.name}'"
            yield room.error(f"{key}.center", message, "move the panels apart")


def panel_warnings(room: TriangleArray, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: warnings of a RIS panel never in front, implausible, beyond the room, or of a long delay spread."""
    for panel, key in _keyed(room):
        spec, motion = panel.spec, room.scene.agent
        if ((motion.position - panel.center) @ spec.normal <= 0.0).all():
            message = "the agent is never in front of the panel"
            yield room.warning(f"{key}.normal", message, "turn the panel or the path")
        yield from _implausible(room, panel, key, radio)
        yield from _beyond_room(room, panel, key)
        spread = _delay_spread(room, panel)
        if spread * radio.bandwidth > 1.0:
            yield room.warning(f"{key}.rows", *delay_spread_remark(spread, radio.bandwidth))


def _keyed(room: TriangleArray) -> list[tuple[RisPanel, str]]:
    """All RIS panels of a room, each with its key in the scene file."""
    panels = room.scene.panels
    return [(panel, panel_key(number, len(panels))) for number, panel in enumerate(panels)]


def _overlap(one: RisPanel, other: RisPanel) -> bool:
    """Scene check: whether two RIS panels overlap: they look the same way from one plane, and no axis parts them."""
    gap = other.center - one.center
    if one.spec.normal @ other.spec.normal < np.cos(MAX_TURN) or abs(gap @ one.spec.normal) > THICKEST:
        return False
    specs = (one.spec, other.spec)
    halves = [0.5 * spec.spacing * [spec.cols, spec.rows] * np.stack([spec.right, spec.up]).T for spec in specs]
    axes = [one.spec.right, one.spec.up, other.spec.right, other.spec.up]
    return all(abs(gap @ axis) < sum(np.abs(axis @ half).sum() for half in halves) - MIN_CLEARANCE for axis in axes)


def _implausible(room: TriangleArray, panel: RisPanel, key: str, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: warnings of a RIS panel that outdoes a perfect plate, or whose beams are ambiguous."""
    spec = panel.spec
    area = float(spec.spacing[0] * spec.spacing[1])
    excess = 10.0 * np.log10(2.0 * radio.wavelength**2 / (np.pi * area))
    if spec.element == "tang" and excess > 0.5:
        message = f"at {radio.carrier / 1e9:g} GHz 'tang' elements reflect {excess:.2f} dB more than a perfect plate"
        yield room.warning(f"{key}.element", message, "take 'energy', unless the paper's model is wanted")
    widest = max((float(d) for d, n in zip(spec.spacing, (spec.cols, spec.rows), strict=True) if n > 1), default=0.0)
    if widest >= radio.wavelength:
        wave = f"a wavelength or more ({radio.wavelength:.4g} m at {radio.carrier / 1e9:g} GHz)"
        message = f"elements {widest:g} m apart, {wave}: whatever the code, another direction is met as strongly"
        yield room.warning(f"{key}.spacing_m", message, "take half a wavelength or less")


def _too_large(room: TriangleArray, panel: RisPanel, key: str) -> Iterator[Finding]:
    """Scene check: error of a RIS panel with a side longer than the room's diagonal, with the units in which it would
    fit."""
    spec = panel.spec
    sides, diagonal = _sides(panel), float(np.linalg.norm(np.ptp(room.bounds, axis=0)))
    if sides.max() <= diagonal:
        return
    message = f"the panel of {sides[0]:.3g} m x {sides[1]:.3g} m is larger than the room, {diagonal:.3g} m across"
    meant = units_that_fit(sides, lambda fitting: fitting.max() <= diagonal)
    if spec.spacing.max() > WIDEST_SPACING and meant is not None:
        yield room.error(f"{key}.spacing_m", f"{message}; {meant[0]}", meant[1])
    else:
        yield room.error(f"{key}.rows", message, "take fewer elements, or put them closer")


def _sides(panel: RisPanel) -> Floats:
    """Width and height (2,) [m] of a RIS panel."""
    return panel.spec.spacing * [panel.spec.cols, panel.spec.rows]


def _beyond_room(room: TriangleArray, panel: RisPanel, key: str) -> Iterator[Finding]:
    """Scene check: warning of a RIS panel that reaches beyond the bounds of the room."""
    spec, sides = panel.spec, _sides(panel)
    half = 0.5 * (sides[0] * np.abs(spec.right) + sides[1] * np.abs(spec.up))
    low, high = room.bounds
    over = float(np.maximum(low - (panel.center - half), panel.center + half - high).max())
    if over > MIN_CLEARANCE:
        message = f"the panel of {sides[0]:.3g} m x {sides[1]:.3g} m reaches {over:.3g} m beyond the room"
        yield room.warning(f"{key}.rows", message, "take fewer elements, put them closer, or move its center")


def _on_host(room: TriangleArray, panel: RisPanel, key: str) -> Iterator[Finding]:
    """Scene check: errors of a RIS panel that does not lie flat on the wall named as its host, or just before it."""
    names = [r.name for r in room.scene.reflectors]
    _, near = touching(panel.center[None], room.triangles, MIN_CLEARANCE)
    behind = sorted({room.name(t) for t in near})
    if panel.host is None:
        if behind:
            message = f"missing, and the panel lies on '{behind[0]}'"
            yield room.error(f"{key}.host", message, f'add host = "{behind[0]}"')
        return
    if panel.host not in names:
        yield room.error(f"{key}.host", f"'{panel.host}' is no reflector", f"give one of {', '.join(names[:12])}")
        return
    triangles = room.triangles[room.owner == names.index(panel.host)]
    hung = _hung(triangles, panel)
    if not len(hung):
        message, mend = _off_host(triangles, panel)
        there = next((name for number, name in enumerate(names) if _may_host(room, number, panel)), None)
        yield room.error(
            f"{key}.center", message, f'{mend}, or give host = "{there}", which is there' if there else mend
        )
        return
    turn = _turn(triangles[hung], panel)
    if turn > MAX_TURN:
        angle = np.degrees(np.arcsin(min(turn, 1.0)))
        message = f"{angle:.2f} degrees from the normal of '{panel.host}'"
        yield room.error(f"{key}.normal", message, "lay it flat on its host")


def _may_host(room: TriangleArray, reflector: int, panel: RisPanel) -> bool:
    """Whether a RIS panel lies flat on the reflector of this number, or just before it."""
    triangles = room.triangles[room.owner == reflector]
    hung = _hung(triangles, panel)
    return len(hung) > 0 and _turn(triangles[hung], panel) <= MAX_TURN


def _turn(triangles: Floats, panel: RisPanel) -> float:
    """Sine of the least angle between the normals of a RIS panel and of triangles (T, 3, 3) of a host."""
    return float(np.linalg.norm(cross(triangle_planes(triangles)[0], panel.spec.normal), axis=-1).min())


def _hung(triangles: Floats, panel: RisPanel) -> Integers:
    """Numbers of its host's triangles (T, 3, 3) that a RIS panel lies on, or hangs before by at most `THICKEST`."""
    normal, offset = triangle_planes(triangles)
    height, facing = normal @ panel.center - offset, normal @ panel.spec.normal
    before = np.where(np.abs(facing) > 0.5, height * np.copysign(1.0, facing), np.abs(height))
    thickest = np.where(np.abs(facing) > 0.5, THICKEST, MIN_CLEARANCE)  # what stands across it has nothing hung before
    near = np.flatnonzero((before >= -MIN_CLEARANCE) & (before <= thickest))
    feet = panel.center - height[near, None] * normal[near]
    on = [len(touching(foot[None], triangles[t][None], MIN_CLEARANCE)[0]) for foot, t in zip(feet, near, strict=True)]
    return near[np.array(on, dtype=np.int64) > 0]


def _off_host(triangles: Floats, panel: RisPanel) -> tuple[str, str]:
    """Message that a RIS panel is off its host of these triangles (T, 3, 3), and how to mend it: the center to give,
    if there is one in the plane that is nearest."""
    normal, offset = triangle_planes(triangles)
    height, across = normal @ panel.center - offset, np.abs(normal @ panel.spec.normal) <= 0.5
    nearest = int(np.argmin(np.where(across & ~across.all(), np.inf, np.abs(height))))
    foot, gap = panel.center - height[nearest] * normal[nearest], float(abs(height[nearest]))
    beside = not len(touching(foot[None], triangles, MIN_CLEARANCE)[0])
    if gap <= MIN_CLEARANCE or (beside and gap <= THICKEST):
        return f"{panel.center.tolist()} lies beside '{panel.host}', in its plane", "move the panel onto its host"
    mend = "move the panel onto its host" if beside else f"give center = {(np.round(foot, 6) + 0.0).tolist()}"
    far = f"{panel.center.tolist()} is {gap * 1e3:.3g} mm off '{panel.host}'"
    return f"{far}, and a panel lies on its host, or at most {THICKEST * 1e3:g} mm before it", mend


def _facing(room: TriangleArray, panel: RisPanel, key: str) -> Iterator[Finding]:
    """Scene check: error of a RIS panel with nothing before it but something behind, unless the agent is before it."""
    ahead, behind = (
        ray_hits(panel.center + 2.0 * MIN_CLEARANCE * look, look[None], room.triangles)[0] >= 0
        for look in (panel.spec.normal, -panel.spec.normal)
    )
    before = ((room.scene.agent.position - panel.center) @ panel.spec.normal > 0.0).any()
    if behind and not ahead and not before:
        yield room.error(f"{key}.normal", f"{panel.spec.normal.tolist()} points out of the room", "reverse it")


def _delay_spread(room: TriangleArray, panel: RisPanel) -> float:
    """Scene check: delay spread over a RIS panel [s], the largest difference of Tx, element, Rx, at 50 cycles."""
    motion = room.scene.agent
    cycles = np.unique(np.linspace(0, len(motion) - 1, 50).astype(np.int64))
    corners = panel.spec.offsets()[:: max(panel.spec.rows - 1, 1), :: max(panel.spec.cols - 1, 1)].reshape(-1, 3)
    elements = panel.center + np.concatenate([corners, np.zeros((1, 3))])
    length = sum(np.linalg.norm(end[cycles, None, :] - elements, axis=-1) for end in (motion.tx, motion.rx))
    return float(np.ptp(length, axis=1).max() / SPEED_OF_LIGHT)
