"""The control channel: codes that come late, get lost, or are named in fewer levels than the panel has."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import RisCode, RisSpec
from rislam_rt.pipeline.control_link import check_control, message_seconds, open_link, quantise, send_code
from rislam_rt.pipeline.specification.pipeline_spec import ControlSection

PANEL = RisSpec(2, 3, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), 4)


def code(level):
    return RisCode(np.full((2, 3), level), 4)


def run(control, levels):
    """Levels applied and believed after sending one uniform code a cycle."""
    link, rng, history = open_link(PANEL), np.random.default_rng(0), []
    for level in levels:
        link = send_code(link, code(level), control, rng=rng)
        history.append((int(link.applied.index[0, 0]), int(link.believed.index[0, 0])))
    return history


def test_prompt_code_is_applied_in_its_own_cycle():
    assert run(ControlSection(), [1, 2, 3]) == [(1, 1), (2, 2), (3, 3)]


def test_late_code_is_applied_late_and_the_agent_knows():
    assert run(ControlSection(delay_cycles=2), [1, 2, 3, 1]) == [(0, 0), (0, 0), (1, 1), (2, 2)]


def test_lost_code_leaves_the_panel_and_deceives_the_agent():
    assert run(ControlSection(loss_probability=1.0), [1, 2]) == [(0, 1), (0, 2)]


def test_losses_come_at_their_rate():
    history = run(ControlSection(loss_probability=0.25), [1 + k % 3 for k in range(4000)])
    lost = np.mean([applied != believed for applied, believed in history])
    # a loss leaves the previous code, which always differs; 4 standard deviations of a proportion over 4000 draws
    assert lost == pytest.approx(0.25, abs=4.0 * np.sqrt(0.25 * 0.75 / 4000))


def test_coarse_message_names_the_nearest_code():
    fine = RisCode(np.arange(8)[None], 8)
    coarse = quantise(fine, 4)
    step = np.abs(np.exp(-1j * coarse.xi) - np.exp(-1j * fine.xi))
    grid = np.exp(-1j * np.arange(4) * np.pi / 2.0)
    nearest = np.abs(grid[:, None] - np.exp(-1j * fine.xi)[0]).min(axis=0)
    np.testing.assert_allclose(step[0], nearest, atol=1e-12)
    assert coarse.levels == 8


def test_message_time_is_bits_over_rate():
    assert message_seconds(PANEL, ControlSection(rate_bits_s=1200.0)) == pytest.approx(6 * 2 / 1200.0)


def test_message_levels_must_divide_the_panels():
    check_control(PANEL, ControlSection(levels=2))
    with pytest.raises(ConfigError, match=r"control\.levels: 3"):
        check_control(PANEL, ControlSection(levels=3))
