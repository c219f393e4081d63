"""Warnings of a motion of the agent that receiver or filter does not reckon with: too fast, too short, or
manoeuvring too hard."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rislam_rt.channel.doppler import end_velocities
from rislam_rt.constants import MAX_SPEED
from rislam_rt.input_messages import counted
from rislam_rt.measurement import ReceiverConfig
from rislam_rt.measurement.slot_motion import slot_weights
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.pipeline.cycle import usual_step
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.pipeline.specification.pipeline_spec import BudgetSection
from rislam_rt.scene.findings import Finding, warning_at
from rislam_rt.slam.model_constants import CONSTANTS

GRAVITY = 9.81
"""Acceleration [m/s^2] that nothing which rolls or walks on a floor exceeds: friction carries about its weight."""

ROUNDING = 1e-6
"""Part of a limit by which a speed may exceed it without a warning: the arithmetic, or the digits of a recording."""

FEWEST_DIGITS, MOST_DIGITS = 3, 17
"""Significant digits of a speed in a message, and how many tell any two numbers of float64 apart."""


def motion_warnings(
    scene: Scene, radio: RadioConfig, receiver: ReceiverConfig, budget: BudgetSection, file: str
) -> Iterator[Finding]:  # fmt: skip
    """Warnings of an agent that is faster than its receiver assumes, but for rounding, so fast that returns average out
    within a measurement slot, or that speeds up as nothing on a floor does; `file` is what they name as their place."""
    if receiver.alternation and scene.ris is not None:
        yield from _fast_agent(scene, receiver.top_speed, file)
    yield from _averaged_returns(scene, radio, receiver, budget, file)
    yield from _manoeuvring_agent(scene, file)


def short_motion_warnings(scene: Scene, budget: BudgetSection, file: str) -> Iterator[Finding]:
    """Warning of a motion too short for anything to count as heard; `file` is what it names as its place."""
    time = scene.agent.time
    lasts = float(time[-1] - time[0]) + (usual_step(time) or budget.total)
    if lasts < HEARD * (1.0 - ROUNDING):
        yield warning_at(
            file, "agent",
            f"a motion of {counted(len(time), 'cycle')}, {lasts:.2g} s: walls, points and panels are told apart by how "
            f"their paths change as the agent moves, and count as heard from {HEARD:g} s on, so that a run locates "
            "little or nothing",
            f"give {HEARD:g} s or more; to look at single places, 'trace' and 'compare' are enough",
        )  # fmt: skip


def _averaged_returns(
    scene: Scene, radio: RadioConfig, receiver: ReceiverConfig, budget: BudgetSection, file: str
) -> Iterator[Finding]:
    """Motion warning of a slot in which a wall's return from ahead loses more than half of its power, as its phase
    turns by its Doppler shift (`measurement.slot_motion`), with the longest slot of one digit that keeps it, and what
    the other steps then are so that all sum to the scene's cycle."""
    tx, rx = end_velocities(scene.agent)
    speed = np.linalg.norm(0.5 * (tx + rx), axis=1)
    cycle = int(np.argmax(speed))
    shift = 2.0 * float(speed[cycle]) / radio.wavelength
    kept = _kept(shift, receiver)
    if kept**2 >= 0.5:
        return
    lost = f"loses {-20.0 * np.log10(kept):.2g} dB of its SNR" if kept > 0.01 else "is not heard"
    message = (
        f"{receiver.slot:g} s, and at {speed[cycle]:.3g} m/s (cycle {cycle}) a wall's return from ahead turns by "
        f"{shift * receiver.slot:.2g} wavelengths within them: it {lost}, so that what moves is heard worst"
    )
    turning = replace(receiver, code_dwell=0.0)  # codes that are held for long keep the slot from being shorter
    slots = [digit * 10.0**power for power in range(-1, -12, -1) for digit in range(9, 0, -1)]
    cycle_s = usual_step(scene.agent.time) or budget.total
    most = min(receiver.slot, budget.fitted(cycle_s)["measure_s"])
    slot = next(slot for slot in slots if slot <= most and _kept(shift, replace(turning, slot=slot)) ** 2 >= 0.5)
    settings = budget.options(budget.fitted(cycle_s, float(f"{slot:.1g}")))
    if _kept(shift, replace(receiver, slot=slot)) ** 2 < 0.5:
        settings = f"{settings} --set receiver.code_dwell=0".lstrip()
    yield warning_at(file, "budget.measure_s", message, f"give {settings}, which leaves the cycle as long as it is")


def _kept(shift: float, receiver: ReceiverConfig) -> float:
    """Share of a path's amplitude that is left in the mean over the slot, of a Doppler shift [Hz]."""
    return float(np.abs(slot_weights(np.array([shift]), receiver)[0][0]))


def _fast_agent(scene: Scene, top_speed: float, file: str) -> Iterator[Finding]:
    """Motion warning of a speed above the receiver's `top_speed` [m/s]."""
    speed, motion = np.linalg.norm(scene.agent.velocity, axis=1), scene.agent
    step = np.linalg.norm(np.diff(motion.position, axis=0), axis=1) / np.diff(motion.time)
    if step.max(initial=0.0) > MAX_SPEED:  # a jump, which the scene check names by its step's speed
        speed[:-1] = np.maximum(speed[:-1], step)
    cycle = int(np.argmax(speed))
    least = float(speed[cycle]) / (1.0 + ROUNDING)
    if least > top_speed:
        limit, fastest = _unequal(top_speed, float(speed[cycle]))
        message = (
            f"{limit} m/s, and the agent moves at up to {fastest} m/s (cycle {cycle}): paths over walls "
            "and scatterers may pass for the panel's"
        )
        mend = f"give receiver.top_speed = {np.ceil(10.0 * least) / 10.0:g}"
        yield warning_at(file, "receiver.top_speed", message, mend)


def _unequal(limit: float, value: float) -> tuple[str, str]:
    """Spelling of a limit and of a value beyond it in a motion warning, with as many digits as tell them apart."""
    digits = range(FEWEST_DIGITS, MOST_DIGITS)
    return f"{limit:g}", next((text for n in digits if (text := f"{value:.{n}g}") != f"{limit:.{n}g}"), repr(value))


def _manoeuvring_agent(scene: Scene, file: str) -> Iterator[Finding]:
    """Motion warning of an acceleration that no floor gives."""
    change = np.linalg.norm(np.diff(scene.agent.velocity, axis=0), axis=1) / np.diff(scene.agent.time)
    if change.max(initial=0.0) > GRAVITY:
        cycle = int(np.argmax(change))
        message = (
            f"it speeds up or slows down by {change[cycle]:.3g} m/s^2 after cycle {cycle}, more than any floor gives; "
            f"the filter's liveliest motion has a deviation of {CONSTANTS.liveliest:g} m/s^2"
        )
        mend = "mend what jumps there, or smooth the recording"
        yield warning_at(file, "agent", message, mend)
