"""Design by a genie that knows the true paths: the reference for design on the belief, and the command line's
`design`."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.design_problem import DesignProblem, problem_from_arrays
from rislam_rt.design.single_path import exact_code
from rislam_rt.errors import ConfigError
from rislam_rt.information import vertex_gradient
from rislam_rt.model import PathKind, Paths, RadioConfig, RisCode


def panel_columns(paths: Paths, cycle: int) -> Integers:
    """Columns (P,) of a cycle's true paths that meet a panel, for the genie's design, the direct ones first."""
    over_panel = np.flatnonzero(paths.valid[cycle] & np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS)))
    return over_panel[np.argsort(paths.kind[over_panel] != PathKind.RIS, kind="stable")]


def focus_codes(paths: Paths, levels: int) -> RisCode:
    """Codes (K, N, M) of a genie that focus every panel on its direct path, one a cycle, from true paths; level 0 where
    hidden.

    Raises
    ------
    ConfigError
        The paths hold no panel.
    """
    if paths.ris is None:
        raise ConfigError("design: the scene has no panel; add a [ris] section")
    legs, (cycles, _, *shape) = paths.ris, paths.ris.tx.shape
    index = np.zeros((cycles, shape[0] * shape[1]), dtype=np.int64)
    for path in np.flatnonzero(paths.kind == PathKind.RIS):
        span = legs.spans[int(paths.panel[path])]
        response = (legs.tx[:, legs.tx_leg[path]] * legs.rx[:, legs.rx_leg[path]]).reshape(cycles, -1)
        index[:, span] = exact_code(response[:, span], levels)[0]
    return RisCode(index.reshape(cycles, *shape), levels)


def problem_from_paths(
    paths: Paths, tx: Floats, rx: Floats, radio: RadioConfig, levels: int, *, cycle: int = 0,
    prior: Floats | None = None, least_snr: float = 0.0,
) -> DesignProblem:  # fmt: skip
    """Design problem of the genie, on the true paths of one cycle: landmark paths only (no LOS, no VT).

    `tx`, `rx` (3,) [m] are the agent's ends at that cycle.

    Raises
    ------
    ConfigError
        No path meets the panel at that cycle.
    """
    here = paths.valid[cycle]
    over_panel = panel_columns(paths, cycle)
    static = np.flatnonzero(here & np.isin(paths.kind, (PathKind.PS, PathKind.VS)))
    if paths.ris is None or not len(over_panel):
        raise ConfigError("design: no path meets the panel from this position; choose one that the panel sees")
    order = np.concatenate([over_panel, static])
    gradient = vertex_gradient(tx, rx, paths.vertices[cycle, order], paths.num_vertices[order])[:, :2]
    legs = paths.ris
    response = legs.tx[cycle, legs.tx_leg[over_panel]] * legs.rx[cycle, legs.rx_leg[over_panel]]
    met = paths.panel[over_panel]
    # the first path of a panel; of one that is out of sight any: its elements have no response
    panels = tuple((int(np.argmax(met == number)), span) for number, span in enumerate(legs.spans))
    return problem_from_arrays(response, paths.gain[cycle, static], gradient, radio, levels, prior, least_snr, panels)
