"""RIS identification, which point is which panel: Bayesian update by amplitudes and missed detections under the phase
codes.

"Is the panel" predicts the amplitude with no free parameter; "is a scatterer" has one unknown cross-section for all
cycles, integrated out. Silence under a code that would have made it loud speaks against the panel; what is blocked is
silent whatever it is. A receiver that alternates codes tells more: what only the panel's paths can cause. The same
update serves features and tracks from cycle to cycle, and births over a whole history.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.information import amplitude_std
from rislam_rt.model import DataSheet, RadioConfig, RisCode, SensorModel
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL, UNTOLD
from rislam_rt.slam.panel_evidence import (
    STRENGTHS,
    add_evidence,
    log_panel,
    log_panel_missed,
    log_scatterer,
    log_scatterer_missed,
    weigh_silence,
)
from rislam_rt.slam.sampling import even_draws, square_roots
from rislam_rt.slam.window.solver_limits import CERTAIN, DRAWS


class PanelIdentity(NamedTuple):
    """Belief about what N points are, a scatterer or each of Q panels: log odds, strength as a scatterer, occlusion."""

    log_grid: Floats
    """(N, G) log posterior of their strength (root of a cross-section), were they scatterers (see `panel_evidence`)."""
    log_ris: Floats
    """(N, Q) log odds of each of Q panels against scatterer."""
    hidden: Floats
    """(N, Q + 1) probability of being occluded, were it each of the panels, and a scatterer."""

    def take(self, rows: Integers | Booleans) -> "PanelIdentity":
        """RIS identities of only some of the points."""
        return PanelIdentity(*(field[rows] for field in self))

    def put(self, rows: Integers, fresh: "PanelIdentity") -> "PanelIdentity":
        """RIS identities with those of some points replaced."""
        fields = [field.copy() for field in self]
        for field, value in zip(fields, fresh, strict=True):
            field[rows] = value
        return PanelIdentity(*fields)

    def clipped(self) -> "PanelIdentity":
        """RIS identities with log odds clipped (`CERTAIN`), so that new evidence can still turn them."""
        return self._replace(log_ris=np.clip(self.log_ris, -CERTAIN, CERTAIN))

    def join(self, other: "PanelIdentity") -> "PanelIdentity":
        """RIS identities of two sets of points, one after the other."""
        return PanelIdentity(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


@lru_cache(maxsize=1)
def _strength_prior(middle: float, spread: float) -> Floats:
    """Prior log probabilities (G,), for RIS identification, of scatterers' strengths, log-normal about `middle`."""
    log = -0.5 * ((STRENGTHS - np.log(middle)) / spread) ** 2
    return np.asarray(log - np.logaddexp.reduce(log))


def unknown(count: int, panels: int = 1) -> PanelIdentity:
    """RIS identities of so many points beforehand: nothing is known but that panels are fewer than scatterers."""
    return PanelIdentity(
        np.tile(_strength_prior(CONSTANTS.strength, CONSTANTS.strength_std), (count, 1)),
        np.full((count, panels), np.log(CONSTANTS.panels)),
        np.zeros((count, panels + 1)),
    )  # fmt: skip


class PanelObservation(NamedTuple):
    """Amplitudes or missed detections of N points in one cycle, with the geometry that predicts them."""

    place: Floats
    """(N, S, 3) [m] equally likely samples of each point's place."""
    tx: Floats
    """(N, 3) [m] the Tx, or its image in the walls on the leg."""
    rx: Floats
    """(N, 3) [m] the Rx, or its image in the walls on the leg."""
    ratio: Floats
    """(N,) share of the amplitude that the walls on both legs leave."""
    amplitude: Floats
    """(N,) measured amplitude; without a measurement any number."""
    side: Integers
    """(N,) panel that the component ran over, `OTHER` or `UNTOLD` (see `slam.observations`)."""
    seen: Booleans
    """(N,) whether there is a measurement."""


def spread_places(mean: Floats, covariance: Floats) -> Floats:
    """Equally likely samples (N, S, 3), for RIS identification, of Gaussian means (N, 3), covariances (N, 3, 3)."""
    return np.asarray(mean[:, None] + even_draws(DRAWS, mean.shape[1]) @ np.swapaxes(square_roots(covariance), 1, 2))


def gains(sight: PanelObservation, ris: DataSheet | None, code: RisCode | None, radio: RadioConfig) -> Complexes | None:
    """Path gains (Q, N, S), for RIS identification, of each panel under the phase code, were it at each of the sampled
    places; None without a panel or a code.

    The code is the same for all places, or one for each of them, (N, 1, ...).
    """
    if ris is None or code is None:
        return None
    ends, ratio = (sight.tx[:, None], sight.rx[:, None]), sight.ratio[:, None]
    parts = zip(ris.panels, ris.parts(code), strict=True)
    return np.stack([panel_path_gain(spec, part, sight.place, *ends, ratio, radio) for spec, part in parts])


def weigh(before: PanelIdentity, sight: PanelObservation, gain: Complexes | None, sensor: SensorModel) -> PanelIdentity:
    """Update of the panel identities of N points by one cycle, or by several: `sight` then holds N rows a cycle, one
    after the other, and `gain` (Q, K N, S) the panels' path gains."""
    if not len(sight.place):
        return before
    heard = sight.seen.reshape(-1, len(before.log_ris))
    scatterer, panel = (
        each.reshape(*heard.shape, -1) for each in _log_likelihoods(sight, gain, before.log_ris.shape[1], sensor)
    )
    own = sight.side.reshape(*heard.shape, 1) == PANEL + np.arange(panel.shape[2])
    log_grid, log_ris, hidden = before.log_grid.copy(), before.log_ris.copy(), before.hidden.copy()
    for cycle, seen in enumerate(heard):
        at, silent = seen.nonzero()[0], (~seen).nonzero()[0]
        if len(at):
            log_grid[at], log_ris[at] = add_evidence(log_grid[at], log_ris[at], scatterer[cycle, at], panel[cycle, at])
            log_ris[at] += np.where(own[cycle, at], CONSTANTS.max_log_ratio, 0.0)
            hidden[at] = 0.0
        if len(silent) and gain is not None:
            lone = np.logaddexp.reduce(log_grid[silent] + scatterer[cycle, silent], axis=1)
            missed = np.concatenate([panel[cycle, silent], lone[:, None]], axis=1)
            hidden[silent], surplus = weigh_silence(hidden[silent], np.exp(missed))
            log_ris[silent] += surplus
    return PanelIdentity(log_grid, log_ris, hidden)


def log_silence(gain: Complexes, hidden: Floats, sensor: SensorModel) -> Floats:
    """Log probabilities (N, Q) that N points are not detected, were they each of Q panels of path gains (Q, N, S), by
    the probability (N, Q + 1) that something was in the way; for RIS identification."""
    noise = np.full(gain.shape[1], amplitude_std(sensor.radio))
    threshold = float(np.sqrt(2.0 * sensor.threshold) * noise[0])
    missed = np.exp(np.stack([log_panel_missed(noise, of_panel, threshold) for of_panel in gain], axis=1))
    before = hidden[:, :-1] + CONSTANTS.rare * (1.0 - hidden[:, :-1])
    return np.asarray(np.log(before + (1.0 - before) * missed))


def _log_likelihoods(
    sight: PanelObservation, gain: Complexes | None, panels: int, sensor: SensorModel
) -> tuple[Floats, Floats]:
    """Log likelihoods of L amplitudes or missed detections, under every strength of a scatterer (L, G) and under every
    panel (L, Q)."""
    radio, count = sensor.radio, len(sight.place)
    noise = amplitude_std(radio)
    threshold = float(np.sqrt(2.0 * sensor.threshold) * noise)
    middle, std = sight.place.mean(axis=1), np.full(count, noise)
    first, second = (np.maximum(np.linalg.norm(middle - end, axis=1), 0.05) for end in (sight.tx, sight.rx))
    first = first / sight.ratio  # what walls take, a longer way takes as well
    scatterer, panel = np.zeros((count, len(STRENGTHS))), np.full((count, panels), -np.inf)
    at, silent = sight.seen.nonzero()[0], (~sight.seen).nonzero()[0]
    if len(at):
        amplitude, side = sight.amplitude[at], sight.side[at, None]
        scatterer[at] = log_scatterer(amplitude, std[at], first[at], second[at], radio)
        if gain is not None:
            each = np.stack([log_panel(amplitude, std[at], of_panel[at]) for of_panel in gain], axis=1)
            panel[at] = np.where((side == PANEL + np.arange(panels)) | (side == UNTOLD), each, -np.inf)
    if len(silent) and gain is not None:
        scatterer[silent] = log_scatterer_missed(std[silent], first[silent], second[silent], radio, threshold)
        for number, of_panel in enumerate(gain):
            panel[silent, number] = log_panel_missed(std[silent], of_panel[silent], threshold)
    return scatterer, panel
