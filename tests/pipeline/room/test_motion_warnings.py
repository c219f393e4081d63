"""A motion that receiver or filter does not reckon with is said, with its cycle."""

import re
from dataclasses import replace

import numpy as np

from rislam_rt.measurement import ReceiverConfig
from rislam_rt.model import RadioConfig
from rislam_rt.pipeline.room.motion_warnings import motion_warnings
from rislam_rt.pipeline.specification.pipeline_spec import BudgetSection
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_room, shipped_rooms


def said(scene, carrier=10e9, slot=1e-3, budget=None, **receiver):
    """Lines of the warnings, by default with a slot that is short enough for any of these agents."""
    receiver = ReceiverConfig(slot=slot, **receiver)
    budget = budget or BudgetSection(measure_s=slot, localise_s=0.05 - slot)
    return [finding.line for finding in motion_warnings(scene, RadioConfig(carrier), receiver, budget, "scene.toml")]


def faster(room, cycle, velocity):
    """The room's agent with another velocity in one cycle."""
    changed = room.agent.velocity.copy()
    changed[cycle] = velocity
    return replace(room, agent=replace(room.agent, velocity=changed))


def test_a_speed_above_the_receivers_is_said_with_its_cycle(room):
    (line,) = said(faster(room, 7, [0.6, 0.0, 0.0]))
    assert line.startswith("scene.toml: receiver.top_speed: 0.5 m/s, and the agent moves at up to 0.6 m/s (cycle 7)")
    assert line.endswith("give receiver.top_speed = 0.6")
    assert not said(faster(room, 7, [0.6, 0.0, 0.0]), top_speed=0.6)
    for speed, figure in ((0.5001, "0.5001"), (0.500004, "0.500004"), (0.50049, "0.5005")):
        (line,) = said(faster(room, 7, [speed, 0.0, 0.0]))
        assert f"0.5 m/s, and the agent moves at up to {figure} m/s" in line
        assert line.endswith("give receiver.top_speed = 0.6")
    assert not said(faster(room, 7, [0.6, 0.0, 0.0]), alternation=False)
    assert not said(replace(faster(room, 7, [0.6, 0.0, 0.0]), ris=None))


def test_rounding_of_a_speed_raises_no_advice(room):
    """The least tenth with which the warning ends: 0.8 m/s, computed along a way, is 0.8 in one cycle and a little more
    in the next."""
    for speed, wanted in ((0.8, 0.8), (np.nextafter(0.8, 1.0), 0.8), (0.6 * (1.0 + 5e-7), 0.6), (0.80001, 0.9)):
        changed = faster(room, 7, [speed, 0.0, 0.0])
        (line,) = said(changed)
        assert line.endswith(f"give receiver.top_speed = {wanted}")
        assert not said(changed, top_speed=wanted)


def test_a_jump_has_one_speed_whatever_is_said_of_it(room):
    """The scene check names the speed of the step; that of the cycles beside it, from both their steps, is lower."""
    position = room.agent.position.copy()
    position[7:] += np.array([0.0, 1.03, 0.0])
    jumped = replace(room, agent=replace(room.agent, position=position))
    step = np.linalg.norm(position[7] - position[6]) / np.diff(room.agent.time)[6]
    line = said(jumped)[0]
    assert f"0.5 m/s, and the agent moves at up to {step:.3g} m/s (cycle 6)" in line
    assert line.endswith(f"give receiver.top_speed = {np.ceil(10.0 * step) / 10.0:g}")


def test_an_acceleration_that_no_floor_gives_is_said_with_the_filters_liveliest(room):
    step = np.diff(room.agent.time)[6]
    jump = room.agent.velocity[7] + [0.0, 10.0 * step, 0.0]  # a little above 9.81 m/s^2 for one step, and back
    (line,) = said(faster(room, 7, jump), top_speed=2.0)
    assert "scene.toml: agent: it speeds up or slows down by 10 m/s^2 after cycle" in line
    assert "the filter's liveliest motion has a deviation of 1 m/s^2" in line
    assert not said(faster(room, 7, room.agent.velocity[7] + [0.0, 9.0 * step, 0.0]), top_speed=2.0)


def test_the_rooms_that_come_with_the_package_move_as_is_reckoned_with():
    assert not [line for name in shipped_rooms() for line in said(load_scene(find_room(name)))]


def test_a_slot_in_which_returns_turn_too_far_is_said_with_one_that_is_short_enough(room):
    """At half a metre per second and 60 GHz a return from ahead turns twice within 10 ms, and averages to nothing."""
    moving = faster(room, 7, [0.0, 0.5, 0.0])
    (line,) = said(moving, carrier=60e9, slot=0.01)
    assert line.startswith("scene.toml: budget.measure_s: 0.01 s, and at 0.5 m/s (cycle 7) a wall's return from ahead")
    assert "turns by 2 wavelengths within them: it is not heard" in line
    told = "give --set budget.measure_s=0.002 --set budget.localise_s=0.048, which leaves the cycle as long as it is"
    assert line.endswith(told)
    assert not said(moving, carrier=60e9, slot=0.002)
    assert not said(moving, slot=0.01)
    # 2 * 0.7 m/s over 0.03 m for 10 ms, by hand: sinc(0.467)^2 = 0.46
    (line,) = said(faster(room, 7, [0.7, 0.0, 0.0]), top_speed=0.7, slot=0.01)
    assert "turns by 0.47 wavelengths within them: it loses 3.4 dB of its SNR" in line


def test_where_codes_held_for_long_are_all_that_is_amiss_the_slot_stays(room):
    """Each of four codes for as long as the slot: 40 ms, over which a return turns 1.3 times."""
    moving = faster(room, 7, [0.0, 0.5, 0.0])
    (line,) = said(moving, slot=0.01, code_dwell=0.01)
    assert line.endswith("; give --set receiver.code_dwell=0, which leaves the cycle as long as it is")
    assert not said(moving, slot=0.01)


def test_the_slot_that_is_advised_leaves_the_steps_the_scenes_cycle(room):
    """Whatever they sum to before: a run refuses another sum."""
    moving = faster(room, 7, [0.0, 0.5, 0.0])
    for measure in (0.002, 0.01, 0.04):  # in all 0.022, 0.03 and 0.06 s for cycles of 0.1 s
        budget = BudgetSection(optimise_s=0.01, communicate_s=0.01, measure_s=measure, localise_s=0.0)
        (line,) = said(moving, carrier=400e9, slot=measure, budget=budget)
        steps = dict(re.findall(r"--set budget\.(\w+)=(\S+)\b", line))
        changed = budget.model_copy(update={name: float(value) for name, value in steps.items()})
        assert np.isclose(sum(changed.model_dump().values()), 0.1)
        assert not said(moving, carrier=400e9, slot=changed.measure_s, budget=changed)


def test_without_alternation_a_slot_averages_as_much(room):
    (line,) = said(faster(room, 7, [0.0, 0.5, 0.0]), carrier=30e9, slot=0.01, alternation=False)
    assert "is not heard" in line


def test_the_slot_that_is_advised_is_short_enough_and_the_longest_of_one_digit(room):
    """At any speed and carrier, and where codes are held for so long that a shorter slot alone would not do."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        velocity = np.tile([0.0, rng.uniform(0.7, 3.0), 0.0], (len(room.agent), 1))
        moving = replace(room, agent=replace(room.agent, velocity=velocity))
        given = {"carrier": 10.0 ** rng.uniform(10.0, 11.2), "top_speed": 3.0, "code_dwell": rng.choice([0.0, 2.5e-3])}
        (line,) = said(moving, slot=0.01, **given)
        advice = re.search(r"give --set budget.measure_s=(\S+) --set budget.localise_s=([^ ,]+)", line)
        slot, rest = (float(value) for value in advice.groups())
        assert slot > 0.0
        assert np.isclose(slot + rest, 0.05)
        dwell = 0.0 if "receiver.code_dwell=0" in line else given["code_dwell"]
        assert not said(moving, slot=slot, **{**given, "code_dwell": dwell})
        one_more = slot + 10.0 ** np.floor(np.log10(slot) + 1e-9)
        assert one_more > 0.0099 or said(moving, slot=one_more, **{**given, "code_dwell": 0.0})


def test_what_turns_beside_its_middle_is_as_fast_as_its_antennas(room):
    """Both antennas 0.35 m ahead of a body that turns on the spot at 1 rad/s move at 0.35 m/s."""
    count, body = len(room.agent), room.agent.body
    aside = replace(body, tx_offset=np.array([0.35, 0.0, 0.0]), rx_offset=np.array([0.35, 0.0, 0.01]))
    still = np.tile(room.agent.position[:1], (count, 1))
    turning = replace(
        room.agent, position=still, velocity=0.0 * still, heading=room.agent.time - room.agent.time[0], body=aside
    )
    (line,) = said(replace(room, agent=turning), carrier=60e9, slot=0.01)
    assert "at 0.35 m/s" in line
    assert not said(replace(room, agent=turning), slot=0.01)
