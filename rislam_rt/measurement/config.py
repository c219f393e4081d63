"""Configuration of the receiver."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError

ESTIMATORS = ("bound", "waveform")
"""Ways from the channel to multipath components: errors drawn from the Cramér-Rao bound, or a real estimator."""

RESOLUTIONS = ("cell", "joint")
ORDERS = ("ABBA", "AB")


@dataclass(frozen=True, slots=True)
class ReceiverConfig:
    """Everything that the receiver is free to choose. SI units; thresholds in dB refer to the SNR over all antennas."""

    estimator: str = "waveform"
    """`bound` draws errors from the Cramér-Rao bound; `waveform` makes the samples and estimates from them."""
    detection_threshold_db: float = 10.0
    """A component is reported when its measured SNR exceeds this; noise alone does so with probability exp(-SNR)."""
    clutter_rate: float = 0.5
    """Mean number of false components a cycle (`bound`)."""
    leakage_cancellation_db: float = 0.0
    """By how much the Tx-Rx leakage (LOS) is attenuated before sampling."""
    merge: bool = True
    """Whether paths that cannot be resolved come out as one (`bound`)."""
    resolution: str = "cell"
    """What that is (`bound`): `cell`, two paths within 1/B in delay and the array's beam; `joint`, paths among which
    the joint bound cannot share the amplitude out. `joint` draws the errors from that bound too, and costs more."""
    alternation: bool = False
    """Whether the slot is split between the code and its phase-reversed twin, which sets the panel's paths apart."""
    order: str = "ABBA"
    """Order of code and twin within the slot: `ABBA` cancels what moves evenly, `AB` lets it leak."""
    panels: int = 1
    """Panels that are told apart by alternation, each with signs of its own; with fewer than there are, the last stands
    for the rest."""
    code_dwell: float = 0.0
    """Time [s] for which a code is held, the order repeated until the slot is full; 0 goes through it once. The panel
    has to switch as fast."""
    slot: float = 0.01
    """Length [s] of the measurement slot, in which the agent moves on."""
    top_speed: float = 0.5
    """Speed of the agent [m/s] that is reckoned with at most in asking what motion may have left in the difference."""
    min_delay: float = 0.0
    """Components before this delay [s] are not reported."""
    max_delay: float = 80e-9
    """Components after this delay [s] are not reported."""
    false_alarm_rate: float = 0.0
    """Mean number of false components a cycle that noise alone may cause; above 0 it sets the threshold instead."""
    num_subcarriers: int = 0
    """M: tones, or samples, of a sounding; 0 takes as many as the latest delay needs."""
    element_exact: bool = False
    """Whether every element has its own exact delay (`waveform`), instead of plane waves and a narrow band."""
    converter_bits: int = 0
    """Bits of the converters for each of real and imaginary part (`waveform`); 0 for none."""
    max_components: int = 120
    """Most components that are looked for in one cycle (`waveform`)."""

    def __post_init__(self) -> None:
        for name, allowed in (("estimator", ESTIMATORS), ("resolution", RESOLUTIONS), ("order", ORDERS)):
            if getattr(self, name) not in allowed:
                choice = " or ".join(map(repr, allowed))
                raise ConfigError(f"receiver.{name}: '{getattr(self, name)}' received; give {choice}")
        not_negative: tuple[str, ...] = (
            "clutter_rate",
            "leakage_cancellation_db",
            "min_delay",
            "false_alarm_rate",
            "code_dwell",
        )
        not_negative += ("slot", "top_speed")
        for name in ("detection_threshold_db", "max_delay", *not_negative):
            if not np.isfinite(getattr(self, name)):
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give a finite number")
        for name in not_negative:
            if getattr(self, name) < 0.0:
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give 0 or more")
        for name, least, most in (
            ("num_subcarriers", 0, 65536),
            ("converter_bits", 0, 32),
            ("max_components", 1, 1000),
            ("panels", 1, 100),
        ):
            if not least <= getattr(self, name) <= most:
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give {least} to {most}")
        if self.max_delay <= self.min_delay:
            raise ConfigError(
                f"receiver.max_delay: {self.max_delay} s received; give more than min_delay, {self.min_delay} s"
            )

    @property
    def num_captures(self) -> int:
        """Captures of the receiver a cycle: with alternation the sum, and one difference a panel."""
        return 1 + self.panels if self.alternation else 1
