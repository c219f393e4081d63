"""Warnings of wall returns that a filter may take for others, before a run: cancelled, merged, of parallel fronts, of
curved walls."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rislam_rt.adviser.link_budget import Survey
from rislam_rt.arrays import Booleans, Floats, Integers, take_rows
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.geometry.triangles import connected
from rislam_rt.input_messages import counted, share_text
from rislam_rt.measurement import Received, build_sensor, receive
from rislam_rt.measurement.components import NoiselessComponents, merge, single
from rislam_rt.measurement.joint_bound import joint_errors
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import PathKind, Paths
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.scene.findings import Finding, warning_at

LEFT = 0.1
"""Share of their energy, apart, that two cancelled returns leave at most: 10 dB are lost."""
MOST = 0.5
"""Share of the walls' returns that must come in alone: with fewer, most of what is heard of walls is of several."""
WIDEST = 10
"""Times the bandwidth up to which one that parts the returns is looked for."""
LEAST, SWERVE = 0.005, 0.125
"""Distances [m] between two fronts from which and up to which one is taken for the other, to an agent's harm: a wall is
known to millimetres, and in half a second an agent gets aside so far, at 1 m/s^2."""
FACETS = 3
"""Facets heard, each beside one to which it turns by little, from which on a wall is curved, and has no single kink."""
JOINED = 1e-4
"""[m] Distance up to which corners of facets are one, and angle [rad] up to which facets are even."""
BEND = np.deg2rad(15.0)
"""Angle [rad] between facets of a curved wall from which on the filter tells them apart: in galleries of facets of 15,
20 and 30 degrees it errs by a centimetre, of 10, 7.5 and 5 degrees it is lost (docs/slam_measured.md)."""
ROUND_BEND = np.deg2rad(36.0)
"""The same [rad] of a wall that closes round the agent: in round rooms of 6, 8 and 10 facets none of eight runs each
is lost, of 12, 16 and 20 two, four and six (docs/slam_measured.md)."""
PARALLEL = np.deg2rad(1.0)
"""Angle [rad] up to which two fronts are parallel: their returns come from directions closer than an array tells."""


def return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """All warnings of wall returns along a way that was looked at, none where the filter uses none of them; `file` is
    what they name as their place."""
    if looked.settings.slam.use_vt:
        yield from cancelled_return_warnings(looked, file)
        yield from merged_return_warnings(looked, file)
        yield from parallel_front_warnings(looked, file)
        yield from curved_wall_warnings(looked, file)


def cancelled_return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of cancelled returns: at two places along the way or more, with none between where both
    are heard, audible single returns of the same two walls leave less than `LEFT` of their energy; `file` is what it
    names as its place.

    An array with antennas half a wavelength apart hears what comes along its line alike from both ends. In the middle
    between two walls the two returns are in opposite phase where the number of antennas is even, and it hears neither,
    as long as the agent keeps to the middle. At one place alone a way crosses the middle; doors in the walls, before
    which one of them is not heard, part the places where it keeps to it.
    """
    paths, settings = looked.paths, looked.settings
    lone = single_returns(paths)
    audible = audible_paths(paths, settings, use_vt=True)[:, lone]
    both = audible[:, :, None] & audible[:, None]
    cancel = np.stack([_cancel(looked, cycle, lone) for cycle in range(len(both))]) & both
    stays = _as_before(cancel, both) | _as_before(cancel[::-1], both[::-1])[::-1]
    share = stays.any(axis=(1, 2)).mean()
    if not share:
        return
    pair = np.unravel_index(np.argmax(stays.sum(axis=0)), cancel.shape[1:])
    one, other = (paths.label(int(lone[end])).split()[-1] for end in pair)
    apart = 0.25 * SPEED_OF_LIGHT / settings.radio.bandwidth
    yield warning_at(
        file, "agent.trajectory",
        f"at {share_text(share)} of the places along the way that were looked at two walls are equally far on either "
        f"side ('{one}' and '{other}'): their returns, alike to the array and in opposite phase, cancel, and the "
        "filter may take what else it hears for other walls",
        f"lead the way at least {apart:.2g} m off the middle, where they are told apart",
    )  # fmt: skip


def single_returns(paths: Paths) -> Integers:
    """Columns (N,) of the paths that are single returns of walls, for warnings of these."""
    walls = np.sum(paths.tx_walls >= 0, axis=1) + np.sum(paths.rx_walls >= 0, axis=1)
    return np.flatnonzero((paths.landmark < 0) & (walls == 1) & (paths.kind == PathKind.VT))


def _as_before(cancel: Booleans, both: Booleans) -> Booleans:
    """Which pairs of single returns are cancelled at a place (K, N, N) and at the last one where `both` were heard."""
    before, found = np.zeros(cancel.shape[1:], dtype=np.bool_), []
    for one, heard in zip(cancel, both, strict=True):
        found.append(one & before)
        before = np.where(heard, one, before)
    return np.stack(found)


def _cancel(looked: Survey, cycle: int, lone: Integers) -> Booleans:
    """Which pairs (N, N) of single returns, columns of the paths, are cancelled in a cycle: together they have less
    than `LEFT` of the energy that they have apart, over all antennas and the band."""
    paths, radio = looked.paths, looked.settings.radio
    cosines = (paths.arrival[cycle, lone] @ rotation_z(looked.scene.agent.heading[cycle]))[:, :2]
    waves = paths.gain[cycle, lone] * np.exp(2j * np.pi * radio.array.positions(1.0)[:, :2] @ cosines.T)
    energy = np.vecdot(waves.T, waves.T).real
    apart = energy[:, None] + energy
    alike = np.sinc(radio.bandwidth * np.subtract.outer(paths.tau[cycle, lone], paths.tau[cycle, lone]))
    return np.asarray(apart + 2.0 * alike * (waves.conj().T @ waves).real < LEFT * apart)


def merged_return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of merged returns: fewer than `MOST` of the walls' returns come in alone along the way;
    `file` is what it names as its place.

    Which components come out is the receiver's own model: by default the joint bound of all paths, in which paths are
    one where their amplitudes cannot be shared out. Where most returns of walls have something else in them, delay and
    direction of a component are those of no wall.
    """
    settings = looked.settings
    share = lone_share(looked, settings)
    if share >= MOST:
        return
    bandwidth = settings.radio.bandwidth
    message = (
        f"of the walls' returns loud enough to be heard along the way only {share_text(share)} come in alone; the "
        f"others cannot be told from what comes in beside them (1 / B is {SPEED_OF_LIGHT / bandwidth:.2g} m of path), "
        "and the filter takes several for one wall"
    )
    wider = _bandwidth_from_which(looked)
    mend = "take more antennas (radio.array.rows, radio.array.cols)"
    if wider:
        mend = f"give radio.bandwidth_ghz = {1e-9 * wider:.1g}, from which on most come in alone, or {mend}"
    yield warning_at(file, "radio.bandwidth_ghz", message, mend)


def lone_share(looked: Survey, settings: Settings) -> float:
    """Share of the audible single returns of walls, over all places surveyed, that come out as components of their own,
    with no other audible path merged in; one where there are none."""
    paths, radio, receiver = looked.paths, settings.radio, settings.receiver
    audible, alone = np.zeros(paths.valid.shape, dtype=np.bool_), 0
    lone = single_returns(paths)
    audible[:, lone] = audible_paths(paths, settings, use_vt=True)[:, lone]
    for cycle, heading in enumerate(looked.scene.agent.heading):
        heard = split_by_code(receive(paths, cycle, float(heading), radio, receiver), receiver)[0]
        heard = take_rows(heard, radio.integrated_snr(heard.gain) >= settings.sensor.threshold)
        parts = _resolved(heard, settings, paths.num_paths)
        own = parts.gain == heard.gain[np.searchsorted(heard.path, parts.path)]  # nothing was added to the path's own
        alone += int(audible[cycle, parts.path[own]].sum())
    return alone / audible.sum() if audible.any() else 1.0


def _resolved(heard: Received, settings: Settings, num_paths: int) -> NoiselessComponents:
    """Components that the receiver of these settings resolves, of which some are merged."""
    sensor = build_sensor(settings.radio, settings.receiver)
    if sensor.resolution == "joint":
        return joint_errors(heard, settings.radio, settings.receiver, np.zeros((num_paths, 5)))[0]
    return merge(heard, sensor) if sensor.resolution == "cell" else single(heard)


def _bandwidth_from_which(looked: Survey) -> float:
    """Least bandwidth [Hz] of one digit, up to `WIDEST` times the one that was surveyed and twice the carrier, with
    which most of the merged returns come in alone; 0 if none does. More is taken to part more: it is bisected for."""
    radio = looked.settings.radio
    power = 10.0 ** np.floor(np.log10(radio.bandwidth))
    tried = [digit * power * times for times in (1, 10) for digit in range(1, 10)]
    tried = [one for one in tried if radio.bandwidth < one <= WIDEST * radio.bandwidth and one < 2.0 * radio.carrier]
    low, high = 0, len(tried)
    while low < high:
        middle = (low + high) // 2
        wider = looked.settings._replace(radio=replace(radio, bandwidth=tried[middle]))
        try:
            share = lone_share(looked, wider)
        except ConfigError:  # more tones than the receiver may have
            share = 0.0
        low, high = (low, middle) if share >= MOST else (middle + 1, high)
    return tried[low] if low < len(tried) else 0.0


def parallel_front_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of parallel fronts that one may take for each other, the farthest apart: walls from
    `LEAST` to `SWERVE` apart that are heard along the way from the same side; `file` is what it names as its place.

    A board before a wall, a door in its frame or cupboards in a row throw signals back from the same direction. Where
    the return of one ends and that of the other begins, its length changes as if the agent had stepped aside.
    """
    walls = build_walls(looked.scene)
    wall, facing = _heard_fronts(looked, walls)
    if not len(wall):
        return
    middle = np.array([walls.surface(int(each))[0] for each in wall]).reshape(-1, 3)
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


def curved_wall_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of curved walls: `FACETS` facets or more heard along the way belong together, each
    turned by less than `BEND` to one beside it, or `ROUND_BEND` if they close round the agent, and turn by more in all;
    `file` is what it names as its place.

    Where an agent goes past the edge of two facets they are equally far, their returns come out as one that turns from
    one direction into the other, and from then on the new facet passes for the old one. In a round room the nearest
    facet and the farthest are heard, which face each other: nothing tells of the way along them.
    """
    walls = build_walls(looked.scene)
    wall, facing = _heard_fronts(looked, walls)
    for bend, is_round in ((ROUND_BEND, True), (BEND, False)):
        pairs, turns = _slight_turns(walls, bend)
        part = connected(pairs, len(walls))
        for one in np.unique(part[wall]):
            facets, alike = np.flatnonzero(part[wall] == one), facing[part[wall] == one] @ facing[part[wall] == one].T
            closes = np.sum(part[pairs[:, 0]] == one) >= np.sum(part == one) and alike.min() < -np.cos(ROUND_BEND)
            if len(facets) >= FACETS and alike.min() < np.cos(bend) and (closes or not is_round):
                heard = np.isin(pairs, wall[facets]).any(axis=1)
                yield _curved_wall(walls.names[wall[facets[0]]], len(facets), turns[heard], bend, file)
                return


def _curved_wall(name: str, number: int, turns: Floats, bend: float, file: str) -> Finding:
    """Warning of a curved wall: so many facets, `name` the first, that turn by less than `bend` [rad] to the next."""
    sizes = np.rad2deg(turns)
    by = f"{sizes.min():.2g}" + (f" to {sizes.max():.2g}" if sizes.max() > 1.01 * sizes.min() else "")
    around = " that close round the agent" if bend == ROUND_BEND else ""
    return warning_at(
        file, "reflector",
        f"'{name}' and {counted(number - 1, 'other facet')} of curved walls{around} heard along the way turn by {by} "
        "degrees from one to the next: the filter may take the return of one for the next one's, and be lost without "
        "saying so",
        f"give a {'round' if around else 'curved'} wall by facets that turn by {np.rad2deg(bend):.0f} degrees or more",
    )  # fmt: skip


def _slight_turns(walls: Walls, bend: float) -> tuple[Integers, Floats]:
    """Pairs (P, 2) of facets with a common edge that turn by less than `bend` [rad], for warnings of curved walls, and
    their angles (P,) [rad]."""
    places = np.round(walls.triangles.reshape(-1, 3) / JOINED)
    corner = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(corner[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner, edge = walls.wall_of_triangle.repeat(3), np.unique(edges, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(edge, kind="stable")
    next_to = edge[order][1:] == edge[order][:-1]
    pairs = np.stack([owner[order][:-1][next_to], owner[order][1:][next_to]], axis=1)
    turn = np.arccos(np.clip(np.abs(np.vecdot(walls.normal[pairs[:, 0]], walls.normal[pairs[:, 1]])), 0.0, 1.0))
    slight = (turn > JOINED) & (turn < bend - PARALLEL)
    return pairs[slight], turn[slight]


def _heard_fronts(looked: Survey, walls: Walls) -> tuple[Integers, Floats]:
    """Walls (N,) whose single returns are heard along the way, for warnings of these, and their unit normals (N, 3) on
    the side of the agent where each is heard."""
    paths, lone = looked.paths, single_returns(looked.paths)
    heard = audible_paths(paths, looked.settings, use_vt=True)[:, lone]
    lone, heard = lone[heard.any(axis=0)], heard[:, heard.any(axis=0)]
    wall = np.maximum(paths.tx_walls[lone].max(axis=1, initial=-1), paths.rx_walls[lone].max(axis=1, initial=-1))
    away = looked.scene.agent.position @ walls.normal[wall].T - walls.offset[wall]
    away = np.where(heard, away, 0.0).sum(axis=0) / heard.sum(axis=0)
    return wall, np.sign(away)[:, None] * walls.normal[wall]
