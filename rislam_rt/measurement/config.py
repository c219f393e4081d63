"""Settings of the receiver."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError

ESTIMATORS = ("bound",)
"""Ways from the channel to multipath components: errors drawn from the Cramér-Rao bound, or a real estimator."""


@dataclass(frozen=True, slots=True)
class ReceiverConfig:
    """Everything that the receiver is free to choose. SI units; thresholds in dB refer to the SNR over all antennas."""

    estimator: str = "bound"
    detection_threshold_db: float = 10.0
    """A component is reported when its measured SNR exceeds this; noise alone does so with probability exp(-SNR)."""
    clutter_rate: float = 0.5
    """Mean number of false components a cycle (`bound`)."""
    leakage_cancellation_db: float = 0.0
    """By how much the Tx-Rx leakage (LOS) is attenuated before sampling."""
    merge: bool = True
    """Whether paths inside one resolution cell (1/B in delay, the array's beam) come out as one (`bound`)."""
    alternation: bool = False
    """Whether the slot is split between the code and its phase-reversed twin, which sets the panel's paths apart."""
    min_delay: float = 0.0
    """Components before this delay [s] are not reported."""
    max_delay: float = 80e-9
    """Components after this delay [s] are not reported."""

    def __post_init__(self) -> None:
        if self.estimator not in ESTIMATORS:
            raise ConfigError(
                f"receiver.estimator: '{self.estimator}' received; give one of {', '.join(map(repr, ESTIMATORS))}"
            )
        for name in ("detection_threshold_db", "clutter_rate", "leakage_cancellation_db", "min_delay", "max_delay"):
            if not np.isfinite(getattr(self, name)):
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give a finite number")
        for name in ("clutter_rate", "leakage_cancellation_db", "min_delay"):
            if getattr(self, name) < 0.0:
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give 0 or more")
        if self.max_delay <= self.min_delay:
            raise ConfigError(
                f"receiver.max_delay: {self.max_delay} s received; give more than min_delay, {self.min_delay} s"
            )

    @property
    def detection_threshold(self) -> float:
        """Linear threshold on the measured SNR over all antennas."""
        return float(10.0 ** (self.detection_threshold_db / 10.0))
