"""The control channel between agent and panel: a code travels as a message that can be late or lost."""

from typing import NamedTuple

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.model import DataSheet, RisCode
from rislam_rt.pipeline.specification.spec import ControlSection
from rislam_rt.ris import flip_bits, zero_code


class ControlLink(NamedTuple):
    """State of the control channel."""

    applied: RisCode
    """What the panel is set to."""
    believed: RisCode
    """What the agent holds it to be: it knows the delay, but not that a message was lost."""
    waiting: tuple[tuple[RisCode, RisCode | None], ...] = ()
    """Codes on their way, oldest first, and what will arrive of each; None if nothing will."""


def open_link(spec: DataSheet) -> ControlLink:
    """The control link at the start: a panel at level 0, nothing on its way."""
    start = zero_code(spec)
    return ControlLink(start, start)


def send_code(
    link: ControlLink, code: RisCode, control: ControlSection, *, rng: np.random.Generator, bit_flip: float = 0.0
) -> ControlLink:
    """The control link one cycle later, after `code` was sent over a link that turns bits with a probability."""
    arrives = bool(rng.random() >= control.loss_probability)
    sent = quantise(code, control.levels)
    heard = _damaged(sent, control.levels or code.levels, bit_flip, rng=rng) if bit_flip else sent
    waiting = (*link.waiting, (sent, heard if arrives else None))
    if len(waiting) <= control.delay_cycles:
        return link._replace(waiting=waiting)
    (due, came), *rest = waiting
    return ControlLink(link.applied if came is None else came, due, tuple(rest))


def _damaged(code: RisCode, levels: int, bit_flip: float, *, rng: np.random.Generator) -> RisCode:
    """What arrives over the control link of a code whose message names `levels` levels."""
    step = code.levels // levels
    return RisCode(flip_bits(RisCode(code.index // step, levels), bit_flip, rng=rng).index * step, code.levels)


def quantise(code: RisCode, levels: int | None) -> RisCode:
    """Nearest code that a control message of `levels` phase levels can name, in the panel's own levels."""
    if levels is None:
        return code
    step = code.levels // levels
    return RisCode((np.rint(code.index / step).astype(np.int64) % levels) * step, code.levels)


def message_seconds(spec: DataSheet, control: ControlSection) -> float:
    """Air time [s] of one control message: so many bits an element as its levels need."""
    bits = spec.num_elements * int(np.ceil(np.log2(control.levels or spec.levels)))
    return bits / control.rate_bits_s


def check_control(spec: DataSheet, control: ControlSection, bit_flip: float = 0.0) -> None:
    """Check the control message against the panel.

    Raises
    ------
    ConfigError
        The message's levels do not divide the panel's; or bits are turned over and its levels are no power of two.
    """
    levels = control.levels or spec.levels
    if bit_flip and levels & (levels - 1):
        raise ConfigError(f"panel.bit_flip: {bit_flip:g} received with {levels} levels; bits need a power of two")
    if control.levels is not None and spec.levels % control.levels:
        raise ConfigError(
            f"control.levels: {control.levels} received; give a divisor of the panel's {spec.levels} levels"
        )
