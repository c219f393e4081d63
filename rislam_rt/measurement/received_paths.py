"""Received paths of one cycle: those within the array's view, in the body frame, with the leakage attenuated."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, join_rows
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.model import PathKind, Paths, RadioConfig

HORIZON_MARGIN = 1e-3
"""Depth below the horizon [direction cosine] down to which an `upper` array receives, as leakage and level wall returns
come in level."""


class Received(NamedTuple):
    """N paths at the receive array in one cycle."""

    path: Integers
    """(N,) columns of `Paths`."""
    tau: Floats
    """(N,) delay [s]."""
    direction: Floats
    """(N, 3) unit vectors towards the arriving rays, body frame."""
    gain: Complexes
    """(N,) complex gain."""
    panel: Integers
    """(N,) number of the panel that the path meets, whose phase-reversed code changes its sign; -1 for none."""
    wave_radius: Floats
    """(N,) distance [m] from the array back to the point from which the wave spreads: the mirrored Tx or landmark."""
    doppler: Floats
    """(N,) Doppler shift [Hz], by which the paths' phases turn within the slot."""


def receive(
    paths: Paths, cycle: int, heading: float, radio: RadioConfig, config: ReceiverConfig, doppler: Floats | None = None
) -> Received:
    """Received paths of one cycle: those that the array sees, turned to the body frame, the leakage attenuated.

    Parameters
    ----------
    heading
        Of the body about z [rad]; the body frame is the room's, turned back by it.
    doppler
        (P,) shifts of all paths [Hz] (`channel.doppler.doppler_shift`); None if nothing moves within the slot.
    """
    arrival = paths.arrival[cycle] @ rotation_z(np.array(heading))
    heard = paths.valid[cycle] & (paths.gain[cycle] != 0.0)
    path = np.flatnonzero(heard & radio.array.receives(arrival[:, 2], HORIZON_MARGIN))
    kind = paths.kind[path]
    leakage = 10.0 ** (-config.leakage_cancellation_db / 20.0)
    gain = paths.gain[cycle, path] * np.where(kind == PathKind.LOS, leakage, 1.0)
    radius = SPEED_OF_LIGHT * paths.tau[cycle, path]
    shift = np.zeros(len(path)) if doppler is None else doppler[path]
    if config.element_exact:
        radius = radius - _tx_leg_length(paths, cycle, path)
    return Received(path, paths.tau[cycle, path], arrival[path], gain, paths.panel[path], radius, shift)


class Clutter(NamedTuple):
    """Clutter paths without an identity, received like any other: their columns mean nothing from cycle to cycle."""

    paths: Paths
    doppler: Floats
    """(K, P) [Hz] Doppler shifts."""

    def of_cycle(self, cycle: int) -> "Clutter":
        """Received clutter paths of one cycle alone."""
        return Clutter(self.paths.of_cycle(cycle), self.doppler[[cycle]])

    def beside(
        self, received: Received, num_paths: int, cycle: int, heading: float, radio: RadioConfig, config: ReceiverConfig
    ) -> Received:
        """Received paths of a cycle with the clutter's appended, whose columns count on from `num_paths`."""
        more = receive(self.paths, cycle, heading, radio, config, self.doppler[cycle])
        return join_rows([received, more._replace(path=more.path + num_paths)])


def direct_gain(paths: Paths, cycle: int) -> complex:
    """Complex gain of the received paths' direct one (leakage) in a cycle before cancellation; 0 where hidden."""
    return complex(np.sum(paths.gain[cycle, paths.kind == PathKind.LOS]))


def _tx_leg_length(paths: Paths, cycle: int, path: Integers) -> Floats:
    """Lengths (N,) [m] of the Tx legs of received paths; 0 for leakage and wall returns, which spread from the Tx."""
    # The Tx is where the departing rays of all paths meet (least squares); half the path, if they are too few to tell.
    length = np.zeros(len(path))
    landmark = np.flatnonzero(paths.landmark[path] >= 0)
    columns = np.flatnonzero(paths.valid[cycle] & (paths.num_vertices > 0))
    away = paths.departure[cycle, columns]
    across = np.eye(3) - away[:, :, None] * away[:, None, :]
    normal = across.sum(axis=0)
    if len(columns) < 2 or np.linalg.cond(normal) > 1e8:
        length[landmark] = 0.5 * SPEED_OF_LIGHT * paths.tau[cycle, path[landmark]]
        return length
    tx = np.linalg.solve(normal, np.einsum("nij,nj->i", across, paths.vertices[cycle, columns, 0]))
    for row in landmark:
        bounces = int(np.sum(paths.tx_walls[path[row]] >= 0))
        corners = np.vstack([tx, paths.vertices[cycle, path[row], : bounces + 1]])
        length[row] = np.sum(np.linalg.norm(np.diff(corners, axis=0), axis=1))
    return length
