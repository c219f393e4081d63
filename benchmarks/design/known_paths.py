"""Codes and position bounds over many places of known paths: GDOP maps."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.design import DesignConfig, problem_from_paths
from rislam_rt.design.designers import designer
from rislam_rt.errors import ConfigError
from rislam_rt.information import GradientMode, position_bound, position_information, vertex_gradient
from rislam_rt.information.position_bound import PositionBound
from rislam_rt.model import DataSheet, PathKind, Paths, RadioConfig, RisCode

LANDMARK_PATHS = (PathKind.PS, PathKind.VS, PathKind.RIS, PathKind.VRIS)
"""Classes whose far end stands still, so that they say where the agent is once the map is known."""
UNCERTIFIED = DesignConfig(certify=False)


def design_along(
    paths: Paths, tx: Floats, rx: Floats, radio: RadioConfig, ris: DataSheet, *, method: str, rng: np.random.Generator,
    prior: Floats | None = None, least_snr: float = 0.0, config: DesignConfig = UNCERTIFIED,
) -> RisCode:  # fmt: skip
    """The genie's codes (K, N, M), one for each cycle of known paths; for places of a grid as well.

    `tx`, `rx` (K, 3) [m]. Where the panel is out of sight the code is a random one.

    Raises
    ------
    ConfigError
        The paths hold no panel.
    """
    if paths.ris is None:
        raise ConfigError("design: the scene has no panel; add a [ris] section")
    run = designer(method)
    seen: Booleans = np.logical_or.reduce(paths.valid & np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS)), axis=1)
    index = np.empty((paths.num_cycles, ris.rows, ris.cols), dtype=np.int64)
    for cycle, child in enumerate(rng.spawn(paths.num_cycles)):
        if not bool(seen[cycle]):
            index[cycle] = child.integers(ris.levels, size=(ris.rows, ris.cols))
            continue
        problem = problem_from_paths(
            paths, tx[cycle], rx[cycle], radio, ris.levels, cycle=cycle, prior=prior, least_snr=least_snr
        )
        index[cycle] = run(problem, rng=child, config=config).code.index
    return RisCode(index, ris.levels)


def position_error_map(
    paths: Paths, tx: Floats, rx: Floats, radio: RadioConfig, *, mode: GradientMode = "exact",
    prior: Floats | float = 0.0, least_snr: float = 0.0, use_vt: bool = False,
) -> PositionBound:  # fmt: skip
    """Horizontal position bound (K,) at K places, for the code that the paths' gains carry; the map is known.

    Parameters
    ----------
    paths
        One cycle a place, e.g. a grid over the room.
    tx, rx
        (K, 3) ends of the agent [m].
    prior
        (2, 2) or (K, 2, 2) information beforehand [1/m^2].
    least_snr
        SNR over all antennas, linear, below which a path is not detected.
    use_vt
        Whether wall returns count (the walls being known).
    """
    kinds = (*LANDMARK_PATHS, PathKind.VT) if use_vt else LANDMARK_PATHS
    gradient = vertex_gradient(tx, rx, paths.vertices, paths.num_vertices, mode=mode)[..., :2]
    snr = radio.integrated_snr(paths.gain)
    heard = paths.valid & np.isin(paths.kind, kinds) & (snr >= least_snr)
    return position_bound(position_information(gradient, np.where(heard, snr, 0.0), radio), prior)
