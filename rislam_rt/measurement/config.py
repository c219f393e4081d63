"""Configuration of the receiver: detection, resolution, alternation of codes, leakage, sounding."""

from dataclasses import dataclass

from rislam_rt.errors import ConfigError

ESTIMATORS = ("bound", "waveform")
"""Ways from the channel to multipath components: errors drawn from the Cramér-Rao bound, or a real estimator."""
RESOLUTIONS = ("cell", "joint")
"""Values of `ReceiverConfig.resolution`: criteria by which paths cannot be resolved."""
ORDERS = ("ABBA", "AB")
"""Values of `ReceiverConfig.order`: orders of a code and its phase-reversed one within the slot."""
MOST_TONES = 65536
"""Largest number of tones of a sounding: memory and time of the estimator grow with it."""
RANGES: dict[str, tuple[float, float]] = {
    "detection_threshold_db": (2.0, 60.0), "clutter_rate": (0.0, 1e4), "leakage_cancellation_db": (0.0, 300.0),
    "code_dwell": (0.0, 1e12), "slot": (0.0, 1e12), "top_speed": (0.0, 1e12), "min_delay": (0.0, 1.0),
    "max_delay": (0.0, 1.0), "false_alarm_rate": (0.0, 1e12), "num_subcarriers": (0, MOST_TONES),
    "converter_bits": (0, 32), "max_components": (1, 1000), "panels": (1, 100),
}  # fmt: skip
"""Smallest and largest value of each setting of the receiver. Below 2 dB the law of false alarms, one of high levels,
gives a negative number; above 60 dB nothing is detected; a delay of 1 s is beyond every scene."""
LEAST_RATE = 1e-100
"""Smallest false-alarm rate above 0 [components a cycle]: float64 cannot tell a threshold for fewer."""


@dataclass(frozen=True, slots=True)
class ReceiverConfig:
    """Settings of the receiver. SI units; thresholds in dB refer to the SNR over all antennas."""

    estimator: str = "waveform"
    """`bound` draws errors from the Cramér-Rao bound; `waveform` makes the samples and estimates from them."""
    detection_threshold_db: float = 10.0
    """A component is reported when its measured SNR exceeds this; noise alone does so with probability exp(-SNR)."""
    clutter_rate: float = 0.5
    """Mean number of false components a cycle (`bound`)."""
    leakage_cancellation_db: float = 0.0
    """Attenuation [dB] of the Tx-Rx leakage (LOS) before sampling."""
    merge: bool = True
    """Whether paths that cannot be resolved come out as one (`bound`)."""
    resolution: str = "cell"
    """Which paths cannot be resolved (`bound`): `cell`, two within 1/B in delay and the array's beam; `joint`, those
    among which the joint bound cannot share the amplitude out. `joint` draws the errors from that bound too, and costs
    more."""
    alternation: bool = True
    """Whether the slot is split between the code and its phase-reversed one, which sets the panel's paths apart; for a
    room without a panel give False (the pipeline does)."""
    order: str = "ABBA"
    """Order of the code (A) and its phase-reversed one (B) within the slot: `ABBA` cancels the first order of motion,
    `AB` lets it leak."""
    panels: int = 1
    """Number of panels that alternation tells apart, each with signs of its own; with fewer than there are, the last
    stands for the rest."""
    code_dwell: float = 0.0
    """Time [s] for which a code is held, the order repeated until the slot is full; 0 goes through it once. The panel
    has to switch as fast."""
    slot: float = 0.01
    """Length [s] of the measurement slot, in which the agent moves on."""
    top_speed: float = 0.5
    """Largest speed of the agent [m/s] assumed for the paths that motion leaves in the difference of two codes."""
    min_delay: float = 0.0
    """Components before this delay [s] are not reported."""
    max_delay: float = 80e-9
    """Components after this delay [s] are not reported."""
    false_alarm_rate: float = 0.0
    """Mean number of false components a cycle that noise alone may cause, in all captures together; above 0 it sets the
    threshold instead."""
    num_subcarriers: int = 0
    """Number M of tones, or samples, of a sounding; 0 takes as many as the latest delay needs."""
    element_exact: bool = False
    """Whether every element has its own exact delay (`waveform`), instead of plane waves and a narrow band."""
    converter_bits: int = 0
    """Bits of the analogue-to-digital converters for each of real and imaginary part (`waveform`); 0 for no
    quantisation."""
    max_components: int = 120
    """Largest number of components estimated in one capture (`waveform`)."""

    def __post_init__(self) -> None:
        for name, allowed in (("estimator", ESTIMATORS), ("resolution", RESOLUTIONS), ("order", ORDERS)):
            if getattr(self, name) not in allowed:
                choice = " or ".join(map(repr, allowed))
                raise ConfigError(f"receiver.{name}: '{getattr(self, name)}' received; give {choice}")
        for name, (least, most) in RANGES.items():
            if not least <= getattr(self, name) <= most:
                raise ConfigError(f"receiver.{name}: {getattr(self, name)} received; give {least:g} to {most:g}")
        if 0.0 < self.false_alarm_rate < LEAST_RATE:
            raise ConfigError(
                f"receiver.false_alarm_rate: {self.false_alarm_rate} received; give 0, or at least {LEAST_RATE:g}"
            )
        if self.num_subcarriers == 1:
            raise ConfigError("receiver.num_subcarriers: 1 received; one tone tells no delay, give 0, or 2 or more")
        if self.max_delay <= self.min_delay:
            raise ConfigError(
                f"receiver.max_delay: {self.max_delay} s received; give more than min_delay, {self.min_delay} s"
            )

    @property
    def num_captures(self) -> int:
        """Number of captures a cycle: one, or with alternation the codes' sum and one difference for each panel."""
        return 1 + self.panels if self.alternation else 1


def check_half_turn(levels: int) -> None:
    """Check that half a turn is among the phase levels of a panel, as a receiver that alternates codes needs it.

    Raises
    ------
    ConfigError
        Their number is odd.
    """
    if levels % 2:
        raise ConfigError(
            f"ris.levels: {levels} received; alternation needs an even number of phase levels, half a turn among "
            "them; give one, or receiver.alternation = false, which holds one code for the whole slot"
        )
