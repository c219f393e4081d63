"""A panel that is not what its data sheet says, a link that damages codes, and warnings that reach the result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind, RisCode, RisSpec
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.control_link import check_control, open_link, send_code
from rislam_rt.pipeline.run import run_warnings
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.specification.pipeline_spec import ControlSection
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run, read_run

SPEC = RisSpec(20, 30, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), 4)
PIPELINE = Path(__file__).parents[2] / "pipelines" / "trace_then_slam.toml"
RANDOM = 'schemes=["random"]'


def panel_gain(result):
    """(K, P) true gains of the paths over the panel."""
    over = np.isin(result.paths.kind, (PathKind.RIS, PathKind.VRIS))
    return result.schemes["random"].gain[:, over]


def test_dead_elements_reflect_nothing(run_short):
    dead = run_short(RANDOM, "panel.dead=1.0")
    assert not panel_gain(dead).any()
    assert panel_gain(run_short(RANDOM)).any()


def test_stuck_elements_keep_their_level_and_the_agent_is_not_told(run_short):
    scheme = run_short(RANDOM, "panel.stuck=1.0").schemes["random"]
    assert (scheme.applied == scheme.applied[0]).all()
    assert (scheme.sent != scheme.sent[0]).any()


def test_one_seed_one_panel_and_other_numbers_stay_as_they_are(run_short, short_result):
    """A tolerance changes the panel's gains and nothing that is drawn elsewhere: random codes stay the same."""
    first, again = (run_short(RANDOM, "panel.phase_std_deg=20.0") for _ in range(2))
    np.testing.assert_array_equal(panel_gain(first), panel_gain(again))
    assert (panel_gain(first) != panel_gain(short_result)).any()
    np.testing.assert_array_equal(first.schemes["random"].applied, short_result.schemes["random"].applied)


def test_bits_turn_over_at_their_rate_and_the_agent_does_not_know():
    code = RisCode(np.random.default_rng(0).integers(4, size=(20, 30)), 4)
    link = send_code(open_link(SPEC), code, ControlSection(), rng=np.random.default_rng(1), bit_flip=0.1)
    np.testing.assert_array_equal(link.believed.index, code.index)
    flipped = link.applied.index ^ code.index
    share = np.mean([flipped & 1, flipped >> 1])
    assert share == pytest.approx(0.1, abs=5.0 * np.sqrt(0.09 / 1200))  # five standard deviations of 1200 bits


def test_a_coarse_message_is_damaged_in_its_own_bits():
    """With two levels there is one bit: turned over for certain, every element is half a turn off what was sent."""
    code = RisCode(np.full((20, 30), 2), 4)
    control = ControlSection(levels=2)
    link = send_code(open_link(SPEC), code, control, rng=np.random.default_rng(1), bit_flip=1.0)
    assert (link.applied.index == 0).all()
    assert (link.believed.index == 2).all()


def test_bits_need_a_power_of_two():
    odd = RisSpec(2, 2, SPEC.spacing, SPEC.normal, SPEC.up, 6)
    with pytest.raises(ConfigError, match="power of two"):
        check_control(odd, ControlSection(), 0.1)
    check_control(odd, ControlSection(levels=2), 0.1)
    check_control(odd, ControlSection(), 0.0)


def test_an_agent_faster_than_the_receiver_reckons_with_is_said(room):
    """And one whose returns from ahead turn too far within the slot: at three times the carrier it is too long."""
    scene = replace(room, agent=replace(room.agent, velocity=6.0 * room.agent.velocity))  # 0.6 m/s

    def said(*settings):
        return run_warnings(scene, load_spec(PIPELINE, settings))

    assert len(said()) == 1
    assert "receiver.top_speed: 0.5 m/s" in said()[0]
    assert "give receiver.top_speed = 0.6" in said()[0]
    assert not said("receiver.top_speed=0.6")
    (line,) = said("receiver.top_speed=0.6", "radio.carrier_ghz=30")
    assert "budget.measure_s: 0.01 s, and at 0.6 m/s" in line
    assert not said('schemes=["no_ris"]')
    assert not said("receiver.alternation=false")


def test_a_panel_too_wide_for_the_band_is_said_and_kept(run_short, room, short_spec, short_result, tmp_path):
    assert short_result.warnings == ()
    wide = replace(room.ris.spec, spacing=np.array([0.15, 0.15]))
    scene = replace(room, ris=replace(room.ris, spec=wide))
    result = run_short(RANDOM, "depth=0", scene=scene)
    assert len(result.warnings) == 1
    assert "delays over the panel spread" in result.warnings[0]
    assert summarise(result)["warnings"] == list(result.warnings)
    with open_run(tmp_path / "run", run_identity(short_spec, scene)) as store:
        store["random"] = result.schemes["random"]
        store.complete(result, summarise(result))
    assert read_run(tmp_path / "run").warnings == result.warnings
