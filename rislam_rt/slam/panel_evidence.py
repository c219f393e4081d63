"""Evidence for which landmark is the RIS panel: Bayes' rule on amplitudes under the phase codes that were applied.

"Is the panel" predicts the amplitude with no free parameter (Rician about the panel's gain under the code, averaged
over the belief); "is a scatterer" predicts one unknown cross-section for all cycles, integrated out on a grid. Cycles
in which a landmark does not show count too: of a path near the threshold only the strong amplitudes are ever seen.
"""

from functools import lru_cache

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.model import RadioConfig
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS

STRENGTHS = np.linspace(np.log(1e-3), np.log(3.0), 81)
"""Grid (G,) of a scatterer's log strength, log sqrt(cross-section / m^2): 1 mm to 3 m in steps of 10 %."""
BEYOND = 8.0
"""Standard deviations above the detection threshold from which on no amplitude stays below it."""


def log_rice(amplitude: Floats, mean: Floats, std: Floats) -> Floats:
    """Log density (Rice), as panel evidence, of the amplitude of a path of mean `mean` in complex noise of `std` in
    each real dimension."""
    variance = std**2
    product = amplitude * mean / variance
    bessel = np.log(scipy.special.i0e(product))
    return np.log(amplitude / variance) - 0.5 * (amplitude - mean) ** 2 / variance + bessel


def log_missed(mean: Floats, std: Floats, threshold: float) -> Floats:
    """Log probability, as panel evidence, that a path of mean amplitude `mean` is not reported: below `threshold`,
    occluded or merged.

    Below it is one minus Marcum's Q, a noncentral chi-square of two degrees of freedom.
    """
    level = threshold / std
    below = scipy.special.chndtr(level**2, 2.0, np.minimum(mean / std, level + BEYOND) ** 2)
    return np.asarray(np.log(1.0 - CONSTANTS.shown * (1.0 - below)))


def log_panel(amplitude: Floats, std: Floats, gain: Complexes) -> Floats:
    """Log likelihood (P,) that amplitudes (P,) are those of the RIS panel, averaged over samples (P, S) of its gain."""
    mean = np.abs(gain)
    each = log_rice(amplitude[:, None], mean, _spread(std, mean))
    return np.logaddexp.reduce(each, axis=1) - np.log(gain.shape[1])


def log_panel_missed(std: Floats, gain: Complexes, threshold: float) -> Floats:
    """Log probability (P,) that the RIS panel is not reported, averaged over samples (P, S) of its gain."""
    mean = np.abs(gain)
    each = log_missed(mean, _spread(std, mean), threshold)
    return np.logaddexp.reduce(each, axis=1) - np.log(gain.shape[1])


def log_scatterer(amplitude: Floats, std: Floats, tx_length: Floats, rx_length: Floats, radio: RadioConfig) -> Floats:
    """Log likelihood (P, G) that landmarks of amplitudes (P,) are scatterers, for every strength of the grid."""
    mean = point_amplitude(np.exp(STRENGTHS), tx_length[:, None], rx_length[:, None], radio)
    return log_rice(amplitude[:, None], mean, _spread(std, mean))


def log_scatterer_missed(
    std: Floats, tx_length: Floats, rx_length: Floats, radio: RadioConfig, threshold: float
) -> Floats:
    """Log probability (P, G) that a scatterer is not reported, for every strength of the grid."""
    mean = point_amplitude(np.exp(STRENGTHS), tx_length[:, None], rx_length[:, None], radio)
    return log_missed(mean, _spread(std, mean), threshold)


def strength_moments(log_grid: Floats) -> tuple[Floats, Floats]:
    """Mean and standard deviation (P,) of scatterers' log strengths from grids (P, G) of log likelihoods, beside the
    panel evidence."""
    weight = np.exp(log_grid - np.logaddexp.reduce(log_grid, axis=1, keepdims=True))
    mean = weight @ STRENGTHS
    step = STRENGTHS[1] - STRENGTHS[0]
    return mean, np.sqrt(weight @ STRENGTHS**2 - mean**2 + step**2 / 12.0)


def add_evidence(log_grid: Floats, log_ris: Floats, scatterer: Floats, panel: Floats) -> tuple[Floats, Floats]:
    """Log probabilities (P, G) of scatterer strengths and log odds of panel against scatterer of P landmarks, after one
    cycle's amplitudes.

    Grids are log probabilities. The odds, and what `panel` says of them, are (P,), or (P, Q) for Q panels.
    """
    grid = log_grid + scatterer
    told = np.logaddexp.reduce(grid, axis=1)
    surplus = panel - (told if panel.ndim == 1 else told[:, None])
    return grid - told[:, None], log_ris + surplus.clip(-CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)


def weigh_silence(hidden: Floats, missed: Floats) -> tuple[Floats, Floats]:
    """Update of P landmarks' log odds of Q panels against scatterer by a cycle in which none of them was detected.

    `missed` (P, Q + 1) is the probability of silence while nothing is in the way, `hidden` (P, Q + 1) that something
    is, the scatterer's last. What is blocked is silent whatever it is: a gap tells as much as its first cycles, not
    more with each. Returns the new `hidden`, and what to add to the log odds (P, Q).
    """
    before = hidden + CONSTANTS.rare * (1.0 - hidden)
    silence = before + (1.0 - before) * missed
    surplus = np.log(silence[:, :-1]) - np.log(silence[:, -1:])
    return before / silence, np.clip(surplus, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)


def panel_probabilities(log_ris: Floats) -> Floats:
    """Probabilities (P, Q) that each of P landmarks is each panel, from log odds (P, Q) against scatterer; or (P,).

    A panel is one of the points or none of them, which competes with prior one point's worth; a point is one panel at
    most. Exact, over all ways to give each panel a point of its own or none.
    """
    if not len(log_ris):
        return np.zeros(log_ris.shape)
    table = np.ascontiguousarray(log_ris, dtype=np.float64).reshape(len(log_ris), -1)
    return _probabilities(table.tobytes(), table.shape[1]).reshape(log_ris.shape)


@lru_cache(maxsize=16)
def _probabilities(odds: bytes, panels: int) -> Floats:
    """Probabilities (P, Q) by the panel evidence, as `panel_probabilities`, read-only and cached: asked for several
    times in a cycle."""
    table = np.frombuffer(odds).reshape(-1, panels)
    before, after = _log_ways(table), _log_ways(table[::-1])[::-1]
    total = np.logaddexp.reduce(before[-1, ::-1])
    probability = np.empty(table.shape)
    for panel in range(table.shape[1]):
        # the others' points lie before this one or behind it
        sets = range(before.shape[1])
        apart = [(a, b) for a in sets for b in sets if not (a & b or (a | b) >> panel & 1)]
        rest = np.logaddexp.reduce([before[:-1, a] + after[1:, b] for a, b in apart], axis=0)
        probability[:, panel] = np.exp(table[:, panel] + rest - total)
    probability.flags.writeable = False
    return probability


def ris_probabilities(log_ris: Floats, points: Integers) -> Floats:
    """Probabilities (F, Q) that each feature is each RIS panel, from log odds (F, Q); 0 but for the rows `points`."""
    probability = np.zeros(log_ris.shape)
    probability[points] = panel_probabilities(log_ris[points])
    return probability


def panel_rows(probability: Floats) -> tuple[int, ...]:
    """Row (Q,) of the landmark held for each RIS panel, by a probability (F, Q) above one half; -1 where none is."""
    if not len(probability):
        return (-1,) * probability.shape[1]
    rows = np.argmax(probability, axis=0)
    return tuple(int(row) if probability[row, panel] > 0.5 else -1 for panel, row in enumerate(rows))


def _log_ways(table: Floats) -> Floats:
    """Log weights (P + 1, 2^Q) of giving a set of panels (as bits) different ones of the first 0 to P landmarks, for
    the evidence of all."""
    points, panels = table.shape
    ways = np.full((points + 1, 2**panels), -np.inf)
    ways[:, 0] = 0.0
    for held in range(1, 2**panels):
        last = [ways[:-1, held - (1 << panel)] + table[:, panel] for panel in range(panels) if held >> panel & 1]
        ways[1:, held] = np.logaddexp.accumulate(np.logaddexp.reduce(last, axis=0))
    return ways


def _spread(std: Floats, mean: Floats) -> Floats:
    """Standard deviation (P, N) of amplitudes about their predicted means (P, N), as panel evidence, from noise (P,)
    and model."""
    return np.asarray(np.hypot(std[:, None], CONSTANTS.law * mean))
