"""Linear model of landmarks and walls: how range and angle of every path depend on the agent and on their unknowns.

A landmark path joins two fixed points: the landmark as the Tx sees it, through the walls of the Tx leg, and as the Rx
sees it. Its length is the sum of the two straight distances, its direction of arrival that of the second point. A wall
return is the Tx's own moving image.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.bistatic import cosine_gradient
from rislam_rt.geometry.planes import mirror_chain, plane_tangents
from rislam_rt.information.accuracy import cosine_information
from rislam_rt.information.position_bound import range_information
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory

Unknown = Literal["known", "planes", "images"]
"""Treatments of walls in a bound (see `build_landmark_model`)."""


class LinearMeasurements(NamedTuple):
    """M measurements (ranges, cosines) of a cycle, linear in the agent's position and U unknowns of the map."""

    agent: Floats
    """(M, 3) derivatives by the agent's position."""
    unknown: Floats
    """(M, U) derivatives by the unknowns of landmarks and walls."""
    information: Floats
    """(M,) inverse variances."""


def fewer_rows(rows: LinearMeasurements) -> LinearMeasurements:
    """Compress linear measurements of a cycle to at most as many as unknowns, with the same information, by QR."""
    weighted = np.sqrt(rows.information)[:, None] * np.concatenate([rows.agent, rows.unknown], axis=1)
    if len(weighted) <= weighted.shape[1]:
        return rows
    factor = np.asarray(np.linalg.qr(weighted, mode="r"))
    return LinearMeasurements(factor[:, :3], factor[:, 3:], np.ones(len(factor)))


class WallSpread(NamedTuple):
    """RMS errors of an estimated wall's plane: angle and distance."""

    angle: float
    """[rad] angle between the normals, both tilts together."""
    distance: float
    """[m] distance along the normal, at one point of the wall."""


@dataclass(frozen=True, slots=True, eq=False)
class LandmarkModel:
    """Model of a trajectory's paths as linear measurements of agent's position and unknown landmarks and walls."""

    paths: Paths
    motion: Trajectory
    radio: RadioConfig
    labels: tuple[str, ...]
    """(U,) names of the unknowns."""
    tx_point: Integers
    """(P,) row of the fixed point that the Tx sees, -1 for a path without a landmark."""
    rx_point: Integers
    """(P,) row of the fixed point that the Rx sees, -1 for a path without a landmark."""
    point: Floats
    """(S, 3) fixed points [m]."""
    jacobian: Floats
    """(S, 3, U) derivatives of the fixed points by the unknowns."""
    walls: Unknown
    """Treatment of walls: known, unknown planes, or images as points of their own."""
    wall_normal: Floats
    """(W, 3) unit normals."""
    wall_offset: Floats
    """(W,) [m]: `normal . x = offset`."""
    wall_column: Integers
    """(W,) first unknown of each wall, -1 if it is known."""

    @property
    def num_unknowns(self) -> int:
        """Number U of unknown coordinates of landmarks and walls."""
        return len(self.labels)

    def prior_std(self, length: float = 10.0, tilt: float = 0.5) -> Floats:
        """Prior standard deviations (U,) of the unknown landmarks and walls, by coordinate and offset (`length` [m]) or
        tilt [rad]."""
        return np.array([tilt if " tilt " in label else length for label in self.labels])

    def landmark_error(self, covariance: Floats) -> dict[str, float]:
        """RMS position error [m] of each unknown landmark, by name, from the unknowns' covariance (U, U)."""
        variance = np.diagonal(covariance)
        column = {label: number for number, label in enumerate(self.labels)}
        first = {name: column.get(f"{name} x") for name in self.paths.landmarks}
        return {name: float(np.sqrt(variance[c : c + 3].sum())) for name, c in first.items() if c is not None}

    def wall_error(self, covariance: Floats, at: Floats) -> dict[str, WallSpread]:
        """RMS angle and distance errors of each unknown wall, by name, from the unknowns' covariance (U, U).

        `at` (W, 3) [m] holds the point of each wall where its distance is asked for.
        """
        found = {}
        for wall in np.flatnonzero(self.wall_column >= 0):
            own = self.wall_column[wall] + np.arange(3)
            block = covariance[np.ix_(own, own)]
            # a point x of the wall lies normal . x - offset off it: both tilts and the offset move that
            slope = np.array([*(tangent @ at[wall] for tangent in plane_tangents(self.wall_normal[wall])), -1.0])
            angle, distance = np.sqrt(block[0, 0] + block[1, 1]), np.sqrt(slope @ block @ slope)
            found[self.paths.walls[wall]] = WallSpread(float(angle), float(distance))
        return found

    def rows(
        self, least_snr: float = 10.0, *, angles: bool = True, use_vt: bool = False
    ) -> Iterator[LinearMeasurements]:
        """Yield the linear measurements of each cycle in turn: landmark paths and, if asked for, wall returns.

        Parameters
        ----------
        least_snr
            SNR over all antennas, linear, below which a path is not detected.
        angles
            Whether the direction cosines count, or the delays alone.
        use_vt
            Whether wall returns count too.
        """
        for cycle in range(self.paths.num_cycles):
            yield self._rows_of(cycle, least_snr, angles, use_vt)

    def _rows_of(self, cycle: int, least_snr: float, angles: bool, use_vt: bool) -> LinearMeasurements:
        """Linear measurements of one cycle: range, and with `angles` both cosines, of every detected path."""
        snr = self.radio.integrated_snr(self.paths.gain[cycle])
        heard = self.paths.valid[cycle] & (snr >= least_snr)
        joined = np.flatnonzero(heard & (self.tx_point >= 0))
        parts = [self._joined_rows(cycle, joined)]
        order = joined
        if use_vt:
            bounced = np.flatnonzero(heard & (self.paths.kind == PathKind.VT))
            parts += [self._wall_rows(cycle, int(path)) for path in bounced]
            order = np.concatenate([joined, bounced])
        agent, unknown = (np.concatenate(both) for both in zip(*parts, strict=True))
        cosines = cosine_information(snr[order] / self.radio.array.num_antennas, self.radio)
        information = np.column_stack([range_information(snr[order], self.radio), cosines])
        count = 3 if angles else 1
        return LinearMeasurements(
            agent[:, :count].reshape(-1, 3),
            unknown[:, :count].reshape(-1, self.num_unknowns),
            information[:, :count].ravel(),
        )

    def _joined_rows(self, cycle: int, path: Integers) -> tuple[Floats, Floats]:
        """Derivatives of landmark paths' range and two cosines by the agent (Q, 3, 3) and by the unknowns (Q, 3, U)."""
        tx, rx, heading = self.motion.tx[cycle], self.motion.rx[cycle], self.motion.heading[cycle]
        first, last = self.tx_point[path], self.rx_point[path]
        out, back = unit(tx - self.point[first]), unit(rx - self.point[last])
        cosines = cosine_gradient(np.broadcast_to(rx, back.shape), self.point[last], heading)
        agent = np.concatenate([(out + back)[:, None], cosines], axis=1)
        length = -np.einsum("qi,qiu->qu", out, self.jacobian[first])
        length -= np.einsum("qi,qiu->qu", back, self.jacobian[last])
        return agent, np.concatenate([length[:, None], -cosines @ self.jacobian[last]], axis=1)

    def _wall_rows(self, cycle: int, path: int) -> tuple[Floats, Floats]:
        """Rows of a wall return for the information: derivatives of its range and two cosines by the agent (1, 3, 3)
        and by the unknowns (1, 3, U)."""
        tx, rx, heading = self.motion.tx[cycle], self.motion.rx[cycle], self.motion.heading[cycle]
        walls = self.paths.tx_walls[path][self.paths.tx_walls[path] >= 0]
        chain = mirror_chain(tx, self.wall_normal[walls], self.wall_offset[walls])
        to_image = unit(chain.image - rx)
        cosines = cosine_gradient(rx, chain.image, heading)
        toward = np.concatenate([to_image[None], -cosines])
        agent = toward @ (chain.linear - np.eye(3))
        unknown = np.zeros((3, self.num_unknowns))
        for wall, slope in zip(walls, chain.planes, strict=True):
            column = self.wall_column[wall]
            if column >= 0:
                unknown[:, column : column + 3] += toward @ slope
        return agent[None], unknown[None]


def build_landmark_model(
    paths: Paths, motion: Trajectory, landmark: Floats, wall_normal: Floats, wall_offset: Floats, radio: RadioConfig, *,
    walls: Unknown = "planes",
) -> LandmarkModel:  # fmt: skip
    """Build the linear model of a trajectory's paths: which landmarks and walls are unknown, and derivatives.

    Parameters
    ----------
    landmark
        (N, 3) true positions [m], in the order of `paths.landmarks`.
    wall_normal, wall_offset
        (W, 3), (W,) planes of `paths.walls`.
    walls
        `known`: landmarks alone are unknown; `planes`: and two tilts and the offset of every wall that a landmark
        path or a wall return meets; `images`: every landmark and every image of it is a point of its own, as a filter
        without walls holds them.
    """
    keys, seen = _points_seen(paths)
    names = [paths.landmarks[key[0]] + "".join(f" | {paths.walls[w]}" for w in key[1:]) for key in keys]
    returned = paths.tx_walls[paths.kind == PathKind.VT]
    met = sorted({w for key in keys for w in key[1:]} | set(returned[returned >= 0].tolist()))
    column = np.full(len(wall_offset), -1, dtype=np.int64)
    if walls == "images":
        labels = [f"{name} {axis}" for name in names for axis in "xyz"]
    elif walls in ("known", "planes"):
        labels = [f"{name} {axis}" for name in paths.landmarks for axis in "xyz"]
        if walls == "planes":
            column[met] = len(labels) + 3 * np.arange(len(met))
            labels += [f"{paths.walls[w]} {part}" for w in met for part in ("tilt 1", "tilt 2", "offset")]
    else:
        raise ConfigError(f"walls: '{walls}' received; give 'known', 'planes' or 'images'")
    point = np.zeros((len(keys), 3))
    jacobian = np.zeros((len(keys), 3, len(labels)))
    for row, key in enumerate(keys):
        sequence = np.array(key[1:], dtype=np.int64)
        chain = mirror_chain(landmark[key[0]], wall_normal[sequence], wall_offset[sequence])
        point[row] = chain.image
        if walls == "images":
            jacobian[row, :, 3 * row : 3 * row + 3] = np.eye(3)
            continue
        jacobian[row, :, 3 * key[0] : 3 * key[0] + 3] = chain.linear
        for wall, slope in zip(sequence, chain.planes, strict=True):
            if column[wall] >= 0:
                jacobian[row, :, column[wall] : column[wall] + 3] += slope
    return LandmarkModel(
        paths, motion, radio, tuple(labels), seen[0], seen[1], point, jacobian, walls,
        wall_normal, wall_offset, column,
    )  # fmt: skip


def _points_seen(paths: Paths) -> tuple[list[tuple[int, ...]], Integers]:
    """Fixed points of the landmark model's paths as (landmark, walls that mirror it in turn), and which of them Tx and
    Rx see (2, P)."""
    keys: dict[tuple[int, ...], int] = {}
    seen = np.full((2, paths.num_paths), -1, dtype=np.int64)
    for path in np.flatnonzero(paths.landmark >= 0):
        for side, sequence in enumerate((paths.tx_walls[path], paths.rx_walls[path, ::-1])):
            # from the device outwards: the wall nearest to the landmark mirrors it first
            order = tuple(int(w) for w in sequence[sequence >= 0][::-1])
            seen[side, path] = keys.setdefault((int(paths.landmark[path]), *order), len(keys))
    return list(keys), seen
