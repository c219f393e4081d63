"""The control link between agent and RIS panel: a phase code travels as a message that can be late or lost."""

from typing import NamedTuple

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.model import DataSheet, RisCode
from rislam_rt.pipeline.specification.pipeline_spec import ControlSection
from rislam_rt.ris import flip_bits, zero_code


class ControlLink(NamedTuple):
    """State of the control link to the RIS panel: applied phase code, the one the agent believes, those in transit."""

    applied: RisCode
    """Phase code that the panel is set to."""
    believed: RisCode
    """Phase code that the agent holds to be applied: it knows the delay, but not that a message was lost."""
    waiting: tuple[tuple[RisCode, RisCode | None], ...] = ()
    """Codes in transit, oldest first: each as sent, and as it will arrive (None if it was lost)."""


def open_link(spec: DataSheet) -> ControlLink:
    """Control link at the start of a run: the RIS panel at phase level 0, no message in transit."""
    start = zero_code(spec)
    return ControlLink(start, start)


def send_code(
    link: ControlLink, code: RisCode, control: ControlSection, *, rng: np.random.Generator, bit_flip: float = 0.0
) -> ControlLink:
    """Control link one cycle later, after `code` was sent as a message that may be lost, or arrive with bits flipped.

    `bit_flip` is the probability of each bit.
    """
    arrives = bool(rng.random() >= control.loss_probability)
    sent = quantise(code, control.levels)
    heard = sent
    if bit_flip:
        levels = control.levels or code.levels
        step = code.levels // levels
        message = RisCode(sent.index // step, levels)
        heard = RisCode(flip_bits(message, bit_flip, rng=rng).index * step, code.levels)
    waiting = (*link.waiting, (sent, heard if arrives else None))
    if len(waiting) <= control.delay_cycles:
        return link._replace(waiting=waiting)
    (due, came), *rest = waiting
    return ControlLink(link.applied if came is None else came, due, tuple(rest))


def quantise(code: RisCode, levels: int | None) -> RisCode:
    """Nearest phase code that a control message with `levels` levels can name, given in the panel's own levels."""
    if levels is None:
        return code
    step = code.levels // levels
    return RisCode((np.rint(code.index / step).astype(np.int64) % levels) * step, code.levels)


def message_seconds(spec: DataSheet, control: ControlSection) -> float:
    """Duration [s] of one control message to the RIS panel: bits for the level of every element, over the bit rate."""
    bits = spec.num_elements * int(np.ceil(np.log2(control.levels or spec.levels)))
    return bits / control.rate_bits_s


def check_control(spec: DataSheet, control: ControlSection, bit_flip: float = 0.0) -> None:
    """Check that a control message's phase levels fit the RIS panel's.

    Raises
    ------
    ConfigError
        The message's levels do not divide the panel's; or bits are flipped and its levels are no power of two.
    """
    levels = control.levels or spec.levels
    if bit_flip and levels & (levels - 1):
        raise ConfigError(f"panel.bit_flip: {bit_flip:g} received with {levels} levels; bits need a power of two")
    if control.levels is not None and spec.levels % control.levels:
        raise ConfigError(
            f"control.levels: {control.levels} received; give a divisor of the panel's {spec.levels} levels"
        )
