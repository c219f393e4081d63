"""Configuration of the receiver: detection, resolution, alternation of codes, leakage, sounding."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from rislam_rt.errors import ConfigError
from rislam_rt.ranges import check_ranges

MOST_TONES = 65536
"""Largest number of tones of a sounding: memory and time of the estimator grow with it."""
Threshold = Annotated[float, Ge(2.0), Le(60.0)]
"""[dB] Below 2 dB the law of false alarms, one of high levels, gives a negative number; above 60 dB nothing is
detected."""
Bounded = Annotated[float, Ge(0.0), Le(1e12)]
"""Number of 0 or more whose square float64 carries."""
EARLIEST = -1e-6
"""[s] Earliest delay from which on a receiver listens: the clocks are apart by a microsecond."""
Delay = Annotated[float, Ge(EARLIEST), Le(1.0)]
"""[s] A delay of 1 s is beyond every scene."""
LEAST_RATE = 1e-100
"""Smallest false-alarm rate above 0 [components a cycle]: float64 cannot tell a threshold for fewer."""


@dataclass(frozen=True, slots=True)
class ReceiverConfig:
    """Settings of the receiver. SI units; thresholds in dB refer to the SNR over all antennas."""

    estimator: Literal["bound", "waveform"] = "waveform"
    """`bound` draws errors from the Cramér-Rao bound; `waveform` makes the samples and estimates from them."""
    detection_threshold_db: Threshold = 10.0
    """A component is reported when its measured SNR exceeds this; noise alone does so with probability exp(-SNR)."""
    clutter_rate: Annotated[float, Ge(0.0), Le(1e4)] = 0.5
    """Mean number of false components a cycle (`bound`)."""
    leakage_cancellation_db: Annotated[float, Ge(0.0), Le(300.0)] = 0.0
    """Attenuation [dB] of the Tx-Rx leakage (LOS) before sampling."""
    merge: bool = True
    """Whether paths that cannot be resolved come out as one (`bound`)."""
    resolution: Literal["cell", "joint"] = "cell"
    """Which paths cannot be resolved (`bound`): `cell`, two within 1/B in delay and the array's beam; `joint`, those
    among which the joint bound cannot share the amplitude out. `joint` draws the errors from that bound too, and costs
    more."""
    alternation: bool = True
    """Whether the slot is split between the code and its phase-reversed one, which sets the panel's paths apart; a
    pipeline sets it to False in a room without a panel, and from Python that is for you to do."""
    order: Literal["ABBA", "AB"] = "ABBA"
    """Order of the code (A) and its phase-reversed one (B) within the slot: `ABBA` cancels the first order of motion,
    `AB` lets it leak."""
    panels: Annotated[int, Ge(1), Le(100)] = 1
    """Number of panels that alternation tells apart, each with signs of its own; with fewer than there are, the last
    stands for the rest."""
    code_dwell: Bounded = 0.0
    """Time [s] for which a code is held, the order repeated until the slot is full; 0 goes through it once. The panel
    has to switch as fast."""
    slot: Bounded = 0.01
    """Length [s] of the measurement slot, in which the agent moves on."""
    top_speed: Bounded = 0.5
    """Largest speed of the agent [m/s] assumed for the paths that motion leaves in the difference of two codes."""
    min_delay: Delay = 0.0
    """Components before this delay [s] are not reported; below 0 where the Rx clock may be ahead of the Tx clock."""
    max_delay: Annotated[float, Gt(0.0), Le(1.0)] = 80e-9
    """Components after this delay [s] are not reported."""
    false_alarm_rate: Bounded = 0.0
    """Mean number of false components a cycle that noise alone may cause, in all captures together; above 0 it sets the
    threshold instead."""
    num_subcarriers: Annotated[int, Ge(0), Le(MOST_TONES)] = 0
    """Number M of tones, or samples, of a sounding; 0 takes as many as the latest delay needs."""
    element_exact: bool = False
    """Whether every element has its own exact delay (`waveform`), instead of plane waves and a narrow band."""
    converter_bits: Annotated[int, Ge(0), Le(32)] = 0
    """Bits of the analogue-to-digital converters for each of real and imaginary part (`waveform`); 0 for no
    quantisation."""
    max_components: Annotated[int, Ge(1), Le(1000)] = 120
    """Largest number of components estimated in one capture (`waveform`)."""

    def __post_init__(self) -> None:
        check_ranges("receiver", self)
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
