"""Observations: a cycle's components in the units of the filters, and whether each ran over a panel."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, Measurement, RadioConfig, SensorModel
from rislam_rt.slam.model_constants import CONSTANTS

LOS_MARGIN = 0.1
"""Length [m] beyond the baseline below which a component is the direct path: no landmark can be that near."""
ASIDE = 0.1
"""Difference of each cosine up to which a component arrives from where the Tx is: 6 degrees, for the body's tilt and
what the array errs by."""
FAR = 1e5
"""Length [m], and standard deviation of anything, that stands for an infinite one."""
UNTOLD, OTHER, PANEL = -1, 0, 1
"""Sides of a component, where the receiver sets the panel's paths apart by alternating codes: either, not over the
panel, over the panel (`PANEL` + q for panel q of several)."""


class Observations(NamedTuple):
    """The M multipath components of one cycle in the units of the filters."""

    seen: Floats
    """Lengths [m] and direction cosines in the body frame (M, 3)."""
    std: Floats
    """Standard deviations (M, 3) of length [m] and cosines."""
    log_amplitude: Floats
    """Logarithms (M,) of the amplitudes."""
    log_amplitude_std: Floats
    """Standard deviations (M,) of the log amplitudes."""
    ratio: Floats
    """Amplitudes (M,) over that of free space of the same length."""
    side: Integers | None = None
    """Side (M,) of each component: `PANEL`, `OTHER` or, if either, `UNTOLD`; None where the receiver does not tell."""
    panel_odds: Floats | None = None
    """Log odds (M,) of having run over the panel, of several the likeliest; None where the receiver does not tell."""

    @property
    def sides(self) -> Integers:
        """Side (M,) of each observed component, `UNTOLD` where the receiver does not tell."""
        return np.full(len(self.ratio), UNTOLD) if self.side is None else self.side

    @property
    def odds(self) -> Floats:
        """Log odds (M,) that an observed component ran over the panel, 0 where the receiver does not tell."""
        return np.zeros(len(self.ratio)) if self.panel_odds is None else self.panel_odds

    def take(self, rows: Integers) -> "Observations":
        """Observations of some of the components, by row."""
        return Observations._make(None if field is None else field[rows] for field in self)


def observations_of(measurement: Measurement, radio: RadioConfig, body: Body) -> Observations:
    """Observations in the filter's units of a measurement; nothing stays infinite, no standard deviation zero.

    Where the clocks of Tx and Rx are apart, lengths are counted from the direct path.
    """
    length = np.clip(SPEED_OF_LIGHT * measurement.tau, -FAR, FAR) - clock_offset(measurement, radio, body)
    length = np.clip(length, 0.0, FAR)
    amplitude = np.clip(measurement.amplitude, 1e-30, 1e30)
    free = np.exp(free_space(radio)) / np.maximum(length, 1e-3)
    std = np.concatenate([SPEED_OF_LIGHT * measurement.tau_std[:, None], measurement.cosines_std], axis=1)
    return Observations(
        np.concatenate([length[:, None], np.clip(measurement.cosines, -FAR, FAR)], axis=1),
        np.clip(std, 1e-5, FAR),
        np.log(amplitude),
        np.minimum(measurement.amplitude_std / amplitude, 1.0),
        amplitude / free,
        *side_of(measurement.from_panel, measurement.panel),
    )


def stranger_density(observations: Observations, sensor: SensorModel, new_density: float) -> Floats:
    """Expected density (M,) of new or false components per metre, unit of each cosine and e-fold, at each observation.

    False ones are as strong as noise that passes the threshold, hence rare where a component is strong.
    """
    snr = sensor.radio.integrated_snr(np.exp(observations.log_amplitude))
    false = (
        sensor.false_alarm_density(observations.seen[:, 0] / SPEED_OF_LIGHT, observations.seen[:, 1:]) / SPEED_OF_LIGHT
    )
    return new_density + false * 2.0 * snr * sensor.false_alarm_snr_density(snr)


def side_of(probability: Floats | None, panel: Integers | None = None) -> tuple[Integers | None, Floats | None]:
    """Side (M,) of observed components from the probability (M,) of having run over a panel, and its log odds; None
    without it.

    What may be either is left open. `panel` (M,): which of several panels that is.
    """
    if probability is None:
        return None, None
    odds = np.log(probability / (1.0 - probability))
    return np.where(
        odds > CONSTANTS.log_born,
        PANEL + (0 if panel is None else panel),
        np.where(odds < -CONSTANTS.log_born, OTHER, UNTOLD),
    ), odds


def free_space(radio: RadioConfig) -> float:
    """Log amplitude of an observed path of 1 m in free space."""
    return float(np.log(radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi)))


def clock_offset(measurement: Measurement, radio: RadioConfig, body: Body) -> float:
    """Length [m] by which all paths of a measurement seem longer because the clocks of Tx and Rx are apart, by what its
    direct path seems longer than the baseline; 0 if that is as likely for one clock, or no direct path is known.

    It is known whatever its delay by where the Tx is (`ASIDE`) and as the only one so loud: half of free space over the
    baseline at least. A saturated receiver makes several of it, of which none is. That the clocks are apart is rare
    beforehand, and then by any length within which things are looked for.
    """
    span = body.tx_offset - body.rx_offset
    baseline, period = float(np.linalg.norm(span)), 1.0 / radio.array.spacing
    aside = measurement.cosines - span[:2] / baseline
    aside -= np.round(aside / period) * period  # the array hears its two ends alike
    direct = (np.abs(aside) < ASIDE).all(axis=1) & (np.abs(measurement.tau) < FAR / SPEED_OF_LIGHT)
    direct &= measurement.amplitude * 2.0 * baseline > np.exp(free_space(radio))
    if np.count_nonzero(direct) != 1:
        return 0.0
    late = float(SPEED_OF_LIGHT * measurement.tau[direct][0]) - baseline
    std = float(np.clip(SPEED_OF_LIGHT * measurement.tau_std[direct][0], 1e-5, FAR))
    log_one = -0.5 * (late / std) ** 2 - np.log(np.sqrt(2.0 * np.pi) * std)
    return late if CONSTANTS.log_rare - np.log(2.0 * CONSTANTS.size) > log_one else 0.0


def is_los(observations: Observations, body: Body) -> Booleans:
    """Whether each observed component (M,) is the direct path: no longer than the body's baseline from Tx to Rx."""
    baseline = float(np.linalg.norm(body.tx_offset - body.rx_offset))
    return observations.seen[:, 0] < baseline + LOS_MARGIN + 3.0 * np.minimum(observations.std[:, 0], LOS_MARGIN)
