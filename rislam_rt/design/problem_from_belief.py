"""Design on the agent's belief: the problem from its estimated pose and map and the panel's data sheet, without
truth."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, join_rows
from rislam_rt.design.beam_sweep import BeamSweep, search_code
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.design.design_result import Design, DesignConfig
from rislam_rt.design.designers import blind_design, designer
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.bistatic import path_gradient
from rislam_rt.geometry.planes import mirror, mirror_direction, plane_between
from rislam_rt.information import GradientMode, prior_from_covariance, range_information
from rislam_rt.model import DataSheet, MapEstimate, RadioConfig, RisSpec, SlamEstimate, join_codes, join_sheets
from rislam_rt.ris import leg_response
from rislam_rt.ris.path_gain import point_amplitude

_DEFAULT = DesignConfig()


def design_code(
    belief: SlamEstimate, ris: DataSheet, radio: RadioConfig, *, method: str, rng: np.random.Generator,
    samples: int = 4, config: DesignConfig = _DEFAULT, landmark_uncertainty: bool = False, least_snr: float = 0.0,
    gradient: GradientMode = "exact", sweep: BeamSweep | None = None,
) -> Design:  # fmt: skip
    """Design the panel's phase code for the next cycle from the belief predicted to it, without the truth.

    Parameters
    ----------
    method
        A key of `DESIGNERS`.
    samples
        Over how many positions the expected CRLB is taken: the mean, then the first of `belief.samples`.
    landmark_uncertainty
        Whether each landmark's own covariance discounts its path, as if unrelated to the agent's.
    least_snr
        SNR over all antennas, linear, at which the receiver detects a path every other time. 0, the paper's objective,
        counts the information of paths that will be missed.
    gradient
        Gradient of path lengths by the agent's position: `exact`, or as the paper has it (see `vertex_gradient`).
    sweep
        The sweep for panels that are not known, to go on with; without it, it begins.

    If no landmark is held for the panel yet, the outcome is `NO_PATHS` and the code one that searches for it. Of
    several panels those that are known are designed for together, and the others are searched for.
    """
    chosen = designer(method)
    problem = problem_from_belief(
        belief, ris, radio, samples=samples, landmark_uncertainty=landmark_uncertainty, least_snr=least_snr,
        gradient=gradient,
    )  # fmt: skip
    lit = {one.panel: ris.parts(one.code)[one.panel] for one in belief.suspects if one.code is not None}
    codes = {
        panel: search_code(belief, ris.panels[panel], radio, sweep or BeamSweep(), panel, lit.get(panel))
        for panel in range(len(ris.panels))
        if belief.map.panel_row(panel) < 0
    }
    if problem is None:
        return blind_design(method, join_codes(tuple(codes.values())))
    found = chosen(problem, rng=rng, config=config)
    if not codes:
        return found
    known = [panel for panel in range(len(ris.panels)) if panel not in codes]
    codes |= zip(known, join_sheets(tuple(ris.panels[panel] for panel in known)).parts(found.code), strict=True)
    code = join_codes(tuple(code for _, code in sorted(codes.items())))
    return replace(found, code=code, xi=code.xi)


def problem_from_belief(
    belief: SlamEstimate, ris: DataSheet, radio: RadioConfig, *, samples: int = 4, landmark_uncertainty: bool = False,
    least_snr: float = 0.0, gradient: GradientMode = "exact",
) -> DesignProblem | None:  # fmt: skip
    """Design problem on a belief: responses and gradients of the paths that its map predicts; None without a panel.

    A point landmark gives one path; an image gives two, with its wall on the Rx leg and on the Tx leg. Paths of the
    panel and its images depend on the code, the others do not. The wall between the panel and its image mirrors the
    device, as the panel sees it. Predicted gains follow from the geometry and the landmarks' strengths.
    """
    rows = [belief.map.panel_row(panel) for panel in range(len(ris.panels))]
    known = [(row, panel) for row, panel in zip(rows, ris.panels, strict=True) if row >= 0]
    if not known:
        return None
    sheets, held = join_sheets(tuple(panel for _, panel in known)), [row for row, _ in known]
    position = np.concatenate([belief.position[None], belief.samples[: max(samples - 1, 0)]])
    tx, rx = (end[:, None, :] for end in belief.body.ends(position, np.array(belief.heading, dtype=np.float64)))
    panel, static = _predicted_paths(belief.map, held)
    both = join_rows([panel, static])
    points = belief.map.position
    unit_snr = float(radio.integrated_snr(np.ones(())))
    return DesignProblem(
        response=_panel_responses(belief.map, panel, tx, rx, held, sheets, radio),
        static_gain=_point_gains(belief.map, static, tx, rx, radio),
        gradient=_gradient(points, both, tx, rx, gradient)[..., :2],
        prior=prior_from_covariance(belief.covariance[:2, :2]),
        scale=float(range_information(np.array(unit_snr), radio)),
        levels=sheets.levels,
        variance=_length_variance(belief.map, both, tx, rx) if landmark_uncertainty else None,
        least_power=least_snr / unit_snr,
        panels=tuple((number, sheets.span(number)) for number in range(len(held))),
    )


class _PredictedPaths(NamedTuple):
    """Q paths predicted from a map: rows of the scattering point, and of the points (or images) that Tx, Rx see."""

    source: Integers
    tx_point: Integers
    rx_point: Integers


def _predicted_paths(landmarks: MapEstimate, held: list[int]) -> tuple[_PredictedPaths, _PredictedPaths]:
    """Paths that the belief predicts for a design: over the panels in rows `held`, direct ones first; all others."""
    # Images of images are too weak to matter.
    rows = np.arange(len(landmarks.parent))
    points = rows[landmarks.parent < 0]
    points = np.concatenate([held, points[~np.isin(points, held)]])
    images = rows[(landmarks.parent >= 0) & np.isin(landmarks.parent, points)]
    parents = landmarks.parent[images]
    paths = _PredictedPaths(
        np.concatenate([points, parents, parents]),
        np.concatenate([points, parents, images]),
        np.concatenate([points, images, parents]),
    )
    over_panel = np.isin(paths.source, held)
    return _PredictedPaths(*(field[over_panel] for field in paths)), _PredictedPaths(
        *(field[~over_panel] for field in paths)
    )


def _gradient(points: Floats, paths: _PredictedPaths, tx: Floats, rx: Floats, mode: GradientMode) -> Floats:
    """Gradients (B, Q, 3), for a design on a belief, of the predicted paths' lengths by the agent's position."""
    # The segment between landmark and wall is that between wall and device, mirrored in the wall between landmark and
    # image: so the paper's sum over all segments needs no bounce points. A point that is its own image has no wall.
    if mode == "exact":
        return path_gradient(tx, rx, points[paths.tx_point], points[paths.rx_point])
    last = unit(rx - points[paths.rx_point])
    if mode == "appendix":
        return last
    total = np.zeros_like(last)
    sense = -1.0 if mode == "paper_legs" else 1.0
    for seen, way in ((paths.tx_point, sense * unit(points[paths.tx_point] - tx)), (paths.rx_point, last)):
        inner = mirror_direction(way, unit(points[seen] - points[paths.source]))
        total = total + way + np.where((seen != paths.source)[:, None], inner, 0.0)
    return total


def _ratio(landmarks: MapEstimate, paths: _PredictedPaths) -> Floats:
    """Amplitude ratio (Q,) of the wall reflection on paths that the belief predicts, by the image's strength, else
    1."""
    image = np.where(paths.tx_point != paths.source, paths.tx_point, paths.rx_point)
    return np.where(image != paths.source, landmarks.strength[image], 1.0)


def _panel_responses(
    landmarks: MapEstimate, paths: _PredictedPaths, tx: Floats, rx: Floats, held: list[int], ris: DataSheet,
    radio: RadioConfig,
) -> Complexes:  # fmt: skip
    """Element responses (B, Q, N, M) that the belief predicts for paths over the panels in rows `held`."""
    whole = np.zeros((len(tx), len(paths.source), ris.rows, ris.cols), dtype=np.complex128)
    for number, row in enumerate(held):
        mine = np.flatnonzero(paths.source == row)
        one = _PredictedPaths(*(field[mine] for field in paths))
        whole[:, mine] = ris.place(number, _responses_of(landmarks, one, tx, rx, row, ris.panels[number], radio))
    return whole


def _responses_of(
    landmarks: MapEstimate, paths: _PredictedPaths, tx: Floats, rx: Floats, row: int, ris: RisSpec, radio: RadioConfig
) -> Complexes:
    """Element responses (B, Q, N, M) that the belief predicts for paths over the panel in one row of the map."""
    center, legs = landmarks.position[row], []
    for end, seen, antenna_gain in ((tx, paths.tx_point, radio.tx_gain), (rx, paths.rx_point, radio.rx_gain)):
        # a point that is the panel itself has no plane: its zero normal mirrors nothing
        device = mirror(end, *plane_between(center, landmarks.position[seen]))
        coefficient = np.full(device.shape[:-1], np.sqrt(antenna_gain), dtype=np.complex128)
        with np.errstate(divide="ignore", invalid="ignore"):
            legs.append(leg_response(ris, center, device, coefficient, radio.wavelength))
    # a belief may put the agent onto an element: that response means nothing, and must not spoil the others
    response = _ratio(landmarks, paths)[:, None, None] * legs[0] * legs[1]
    return np.where(np.isfinite(response), response, 0.0)


def _point_gains(
    landmarks: MapEstimate, paths: _PredictedPaths, tx: Floats, rx: Floats, radio: RadioConfig
) -> Complexes:
    """Gains (B, Q) that the belief predicts for paths over points by eq. `a2`, by the root of the cross-section."""
    nearest = radio.wavelength  # a believed landmark may lie on the agent; the law ends about there
    first = np.maximum(np.linalg.norm(landmarks.position[paths.tx_point] - tx, axis=-1), nearest)
    second = np.maximum(np.linalg.norm(landmarks.position[paths.rx_point] - rx, axis=-1), nearest)
    strength = landmarks.strength[paths.source] * _ratio(landmarks, paths)
    phase = np.exp(-2j * np.pi / radio.wavelength * (first + second))
    return point_amplitude(strength, first, second, radio) * phase


def _length_variance(landmarks: MapEstimate, paths: _PredictedPaths, tx: Floats, rx: Floats) -> Floats:
    """Variance (B, Q) [m^2] of path lengths in a design problem from a belief, by the covariances of its landmarks."""
    first = unit(landmarks.position[paths.tx_point] - tx)
    second = unit(landmarks.position[paths.rx_point] - rx)
    tx_spread, rx_spread = landmarks.covariance[paths.tx_point], landmarks.covariance[paths.rx_point]
    variance = np.einsum("bqi,qij,bqj->bq", first, tx_spread, first)
    variance += np.einsum("bqi,qij,bqj->bq", second, rx_spread, second)
    same = (paths.tx_point == paths.rx_point).astype(np.float64)
    return variance + 2.0 * same * np.einsum("bqi,qij,bqj->bq", first, tx_spread, second)
