"""Designs along known paths: gain curves, codes for maps, large panels, and focusing."""

from dataclasses import replace

import numpy as np
import pytest
from known_paths import design_along, position_error_map

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import (
    DESIGNERS,
    DesignConfig,
    DesignProblem,
    direct_only,
    exact_code,
    gain_curves,
    problem_from_paths,
)
from rislam_rt.errors import ConfigError
from rislam_rt.model import Body, PathKind, RisCode, RisSpec, Trajectory
from rislam_rt.ris import far_field_response, leg_response, rephase
from rislam_rt.scene import load_scene


def at(positions):
    count = len(positions)
    return Trajectory(np.arange(float(count)), np.array(positions), np.zeros((count, 3)), np.full(count, 0.3), Body())


@pytest.fixture(scope="module")
def scene():
    return load_scene("scenes/paper_room")


def test_problem_of_the_truth_reproduces_the_channel(scene, radio, rng):
    motion = at([[1.2, 2.2, 0.5], [4.1, 3.3, 0.7]])
    paths = ImageSourceChannel(scene, radio, 1).paths(motion)
    for cycle in range(2):
        problem = problem_from_paths(paths, motion.tx[cycle], motion.rx[cycle], radio, 4, cycle=cycle)
        design = DESIGNERS["random"](problem, rng=rng)
        applied = rephase(paths, RisCode(np.stack([design.code.index] * 2), 4))
        direct = int(np.flatnonzero(paths.kind == PathKind.RIS)[0])
        assert design.gain_db == pytest.approx(20 * np.log10(abs(applied.gain[cycle, direct])), abs=1e-9)
        bound = position_error_map(applied, motion.tx, motion.rx, radio)
        assert design.crlb == pytest.approx(float(bound.variance[cycle]), rel=1e-9)


def test_codes_along_a_path_beat_random_ones_everywhere(scene, radio, rng):
    motion = at([[x, 2.0, 0.5] for x in (0.6, 1.9, 3.2, 4.5)])
    paths = ImageSourceChannel(scene, radio, 1).paths(motion)
    code = design_along(paths, motion.tx, motion.rx, radio, scene.ris.spec, method="coordinate", rng=rng)
    random = RisCode(rng.integers(4, size=code.index.shape), 4)
    designed, drawn = (position_error_map(rephase(paths, c), motion.tx, motion.rx, radio) for c in (code, random))
    assert (designed.variance < drawn.variance).all()
    assert not (code.index[0] == code.index[-1]).all()


def test_paths_without_a_panel_are_refused(scene, radio, rng):
    motion = at([[1.2, 2.2, 0.5]])
    bare = replace(scene, ris=None)
    paths = ImageSourceChannel(bare, radio, 0).paths(motion)
    with pytest.raises(ConfigError, match="no panel"):
        design_along(paths, motion.tx, motion.rx, radio, scene.ris.spec, method="exact", rng=rng)
    with pytest.raises(ConfigError, match="no path meets the panel"):
        problem_from_paths(paths, motion.tx[0], motion.rx[0], radio, 4)


def test_gain_curves_keep_their_order(scene, radio, rng):
    motion = at([[x, x, 0.0001] for x in (0.5, 1.5, 2.9)])
    paths = ImageSourceChannel(scene, radio, 1).paths(motion)
    problems = [direct_only(problem_from_paths(paths, motion.tx[k], motion.rx[k], radio, 4, cycle=k)) for k in range(3)]
    curves = gain_curves(problems, rng=rng, seeds=5, draws=2000)
    assert (curves.exact <= curves.continuous + 1e-12).all()
    assert (curves.optimized.low <= curves.optimized.middle).all()
    assert (curves.optimized.high <= curves.exact + 1e-9).all()
    assert (curves.optimized.middle > curves.exact - 0.5).all()
    # a sum of many random phases is Rayleigh: 5 % of draws lie below rms sqrt(-ln 0.95), 5 % above rms sqrt(-ln 0.05)
    np.testing.assert_allclose(curves.random.low - curves.random.middle, 10 * np.log10(-np.log(0.95)), atol=1.0)
    np.testing.assert_allclose(curves.random.high - curves.random.middle, 10 * np.log10(-np.log(0.05)), atol=0.5)
    # Fig. 4(a): sphere of half the panel's side in its place
    distance = np.linalg.norm(motion.position - [3.0, 3.0, 3.0], axis=1)
    sphere = 20 * np.log10(radio.wavelength * np.sqrt(np.pi) * 0.045 / ((4 * np.pi) ** 1.5 * distance**2))
    assert (curves.optimized.low > curves.random.high).all()
    assert (curves.random.middle[1:] > sphere[1:]).all()


@pytest.mark.parametrize("levels", [2, 4, 8, 16])
@pytest.mark.parametrize("side", [16, 64])
def test_large_panels_focus_on_near_targets(side, levels, radio, rng):
    """An agent well inside 2 D^2 / lambda: the element-wise optimum beats the plane-wave code."""
    spec = RisSpec(side, side, np.array([0.015] * 2), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), levels)
    center, tx, rx = np.array([3.0, 3.0, 3.0]), np.array([2.5, 2.7, 1.8]), np.array([2.6, 2.7, 1.8])
    one = np.complex128(1.0)
    near = leg_response(spec, center, tx, one, radio.wavelength) * leg_response(spec, center, rx, one, radio.wavelength)
    far = far_field_response(spec, center, tx, one, radio.wavelength) * far_field_response(
        spec, center, rx, one, radio.wavelength
    )
    problem = DesignProblem(near[None, None], np.zeros((1, 0)), np.array([[[1.0, 0.5]]]), np.eye(2), 1e6, levels)
    exact = DESIGNERS["exact"](problem, rng=rng)
    plane = exact_code(far.ravel(), levels)[0]
    plane_gain = 20 * np.log10(abs(near.ravel() @ np.exp(-2j * np.pi / levels * plane)))
    assert exact.gain_db > plane_gain + (0.5 if side == 16 else 10.0)
    # many elements: the loss against continuous phases is the mean of a uniform phase error, sinc(1 / H), or a little
    # less, as the best of all common phases is taken
    loss = exact.gain_db - DESIGNERS["continuous"](problem, rng=rng).gain_db
    assert loss == pytest.approx(20 * np.log10(np.sinc(1 / levels)), abs=0.3)
    coordinate = DESIGNERS["coordinate"](problem, rng=rng, config=DesignConfig(max_steps=5))
    assert coordinate.gap_db == pytest.approx(0.0, abs=1e-9)


def test_a_code_for_true_paths_says_more_of_the_place_than_any_code_for_one_of_them(scene, radio, rng):
    """Position bound of the channel itself, of the code that descent finds and of each path's own optimum."""
    motion = at([[x, 1.2, 0.5] for x in (0.7, 2.6, 4.2)])
    paths = ImageSourceChannel(scene, radio, 1).paths(motion)
    code = design_along(paths, motion.tx, motion.rx, radio, scene.ris.spec, method="coordinate", rng=rng)
    found = position_error_map(rephase(paths, code), motion.tx, motion.rx, radio).variance
    for cycle in range(3):
        problem = problem_from_paths(paths, motion.tx[cycle], motion.rx[cycle], radio, 4, cycle=cycle)
        single, _ = exact_code(problem.response[0].reshape(problem.response.shape[1], -1), 4)
        for own in single.reshape(-1, *code.index.shape[1:]):
            index = code.index.copy()
            index[cycle] = own
            sent = rephase(paths, RisCode(index, 4))
            other = position_error_map(sent, motion.tx, motion.rx, radio).variance[cycle]
            assert found[cycle] < other * (1.0 - 1e-3)
