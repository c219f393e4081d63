"""The codes that a scheme sends: designed ones light the panel and tell where the agent is, as random ones do not."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import panel_columns, problem_from_paths
from rislam_rt.information.position_bound import position_bound, position_information
from rislam_rt.model import PathKind, RisCode, empty_map, pose_estimate
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.assumed_model import tell_belief
from rislam_rt.pipeline.code_policies import build_designer
from rislam_rt.pipeline.cycle import GroundTruth
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.ris import rephase
from rislam_rt.shipped import find_pipeline

LAST = slice(-8, None)
"""Cycles from 1.7 s on: the map of the optimised scheme holds the panel."""
LIT = 4.0
"""Power over that of random codes on average. The power of a random code is nearly exponential: above 4 times its mean
in 2 % of draws. The best of four levels gives 36 elements 36 times the mean, less 0.9 dB."""


def panel_power(paths, gain):
    """(K,) of the direct path, over its mean under random codes: the sum of the elements' own powers."""
    column, legs = int(np.flatnonzero(paths.kind == PathKind.RIS)[0]), paths.ris
    elements = legs.tx[:, legs.tx_leg[column]] * legs.rx[:, legs.rx_leg[column]]
    return np.abs(gain[:, column]) ** 2 / (np.abs(elements) ** 2).sum(axis=(1, 2))


@pytest.fixture(scope="module")
def paths(beside_panel):
    """What a run does not keep: the paths with the response of every element."""
    scene = beside_panel.scene
    radio = build_settings(PipelineSpec.model_validate(beside_panel.config)).radio
    return ImageSourceChannel(scene, radio, 1).paths(scene.agent)


def test_the_panel_is_lit_in_every_cycle_once_it_is_known(beside_panel, paths):
    power = {name: panel_power(paths, s.gain)[LAST] for name, s in beside_panel.schemes.items()}
    assert (power["optimized"] > LIT).all()
    assert np.median(power["random"]) < LIT


def test_no_random_code_tells_as_much_of_the_place(beside_panel, paths):
    """Position bound in a map that is known, of the true paths under the code sent and under 100 random ones.

    A random code is the best of 101 in one cycle of 101: in all of eight in one run of 10^16.
    """
    spec, rng = PipelineSpec.model_validate(beside_panel.config), np.random.default_rng(3)
    radio, scene = build_settings(spec).radio, beside_panel.scene
    for cycle in range(len(scene.agent))[LAST]:
        here = paths.of_cycle(cycle)
        gradient = problem_from_paths(here, scene.agent.tx[cycle], scene.agent.rx[cycle], radio, 4).gradient[0]
        sent = RisCode(beside_panel.schemes["optimized"].applied[cycle], 4)
        codes = [sent, *(RisCode(rng.integers(4, size=sent.index.shape), 4) for _ in range(100))]
        bounds = [bound(rephase(here, code), gradient, radio) for code in codes]
        assert bounds[0] < min(bounds[1:])


def bound(paths, gradient, radio):
    """Least mean square error [m^2] of one cycle's position, of panel paths and then of scatterers'."""
    still = np.flatnonzero(paths.valid[0] & np.isin(paths.kind, (PathKind.PS, PathKind.VS)))
    order = np.concatenate([panel_columns(paths, 0), still])
    snr = radio.integrated_snr(paths.gain[0, order])
    return float(position_bound(position_information(gradient, snr, radio), np.eye(2) / 0.01**2).variance)


@pytest.mark.parametrize("method", ["genetic", "exact", "coordinate", "nearest", "continuous"])
def test_every_method_lights_a_panel_that_is_known(room, method):
    """The policy of the scheme, told where agent and panel are, on the true path of a cycle."""
    settings = ["channel=image_source", "depth=0", "cycles=1", f"design.method={method}"]
    spec = load_spec(find_pipeline("trace_then_slam"), settings)
    setup = prepare_setup(replace(room, agent=room.agent[250:251]), spec, rng=np.random.default_rng(1))
    rngs = np.random.default_rng(2).spawn(3)
    told = tell_belief(
        setup.scene.agent, setup.body, room.ris.spec, spec, build_settings(spec), start=rngs[0], compass=rngs[1]
    )
    known = replace(
        empty_map(), ident=[0], position=room.ris.center[None], covariance=1e-4 * np.eye(3)[None], parent=[-1],
        ris_probability=[1.0], strength=[1.0],
    )  # fmt: skip
    start = told.start
    belief = pose_estimate(start.position, start.velocity, start.heading, 1e-4 * np.eye(6), setup.body, known)
    choose = build_designer(SCHEMES["optimized"], room.ris.spec, spec, told.settings, told)
    seen = GroundTruth(setup.paths, setup.scene.agent, np.zeros(setup.paths.gain.shape))
    code = choose(lambda: belief, 0, seen, rng=rngs[2])
    assert panel_power(setup.paths, rephase(setup.paths, code).gain) > LIT
