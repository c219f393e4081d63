"""Scattered and diffracted paths in a run: heard, unnamed, and told to nobody."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.measurement import Clutter, ReceiverConfig, measure
from rislam_rt.model import RadioConfig
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.long import slices
from rislam_rt.pipeline.run import prepare_setup, run_scheme
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_pipeline

PIPELINE = find_pipeline("trace_then_slam")
ROUGH = [
    "cycles=4", "depth=1", "schemes=['optimized']", "room.scattering=0.3", "extras.diffuse=true",
    "receiver.estimator=bound", "design.iterations=5",
]  # fmt: skip


@pytest.fixture(scope="module")
def setup():
    spec = load_spec(PIPELINE, ROUGH)
    return prepare_setup(load_scene("paper_room"), spec, rng=np.random.default_rng(7)), spec


def lead(setup, spec):
    return run_scheme("optimized", setup, spec, lambda *_: None)


def test_what_walls_scatter_is_heard_and_has_no_name(setup):
    setup, spec = setup
    heard, silent = lead(setup, spec), lead(setup._replace(extras=None), spec)
    count = [(result.component_path == -1).sum(axis=1).mean() for result in (heard, silent)]
    assert count[0] > 10.0 * (count[1] + 0.5)
    assert (heard.component_path < setup.paths.num_paths).all()
    again = lead(setup, spec)
    np.testing.assert_array_equal(heard.position, again.position)


def test_rough_walls_reflect_less(setup):
    rough, _ = setup
    smooth = load_spec(PIPELINE, ROUGH[:3])
    plain = prepare_setup(load_scene("paper_room"), smooth, rng=np.random.default_rng(7))
    bounces = (plain.paths.tx_walls >= 0).sum(axis=1) + (plain.paths.rx_walls >= 0).sum(axis=1)
    np.testing.assert_allclose(
        np.abs(rough.paths.gain), np.abs(plain.paths.gain) * np.sqrt(1.0 - 0.09) ** bounces, rtol=2e-6
    )
    assert plain.extras is None
    assert set(bounces) == {0, 1}


def test_slices_hear_it_too(setup, tmp_path, monkeypatch):
    setup, spec = setup
    monkeypatch.setattr(slices, "SLICE", 2)
    tell = lambda *_: None  # noqa: E731
    slices.run_slices("optimized", setup.scene, setup.body, spec, setup.seeds, tmp_path, "0" * 64, tell)
    parts = list(slices.read_parts(tmp_path, "optimized", setup.scene, "0" * 64))
    assert [len(part.motion) for part in parts] == [2, 2]
    assert all((part.scheme.component_path == -1).sum(axis=1).min() > 5 for part in parts)


def test_the_noise_of_named_paths_is_the_same_with_and_without(setup):
    """So that a study is paired: a path that nothing merges with comes out with the same error."""
    setup, _ = setup
    radio, receiver = RadioConfig(), ReceiverConfig(estimator="bound", merge=False)
    faint = replace(setup.extras, gain=1e-9 * setup.extras.gain)
    clutter = Clutter(faint, np.zeros(faint.valid.shape))
    plain, who = measure(setup.paths, 0, 0.3, radio, receiver, rng=np.random.default_rng(1))
    with_it, who_too = measure(setup.paths, 0, 0.3, radio, receiver, clutter=clutter, rng=np.random.default_rng(1))
    for path in set(who.path) - {-1}:
        here, there = plain.tau[who.path == path], with_it.tau[who_too.path == path]
        np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize("estimator", ["bound", "waveform"])
def test_every_receiver_hears_it(setup, estimator):
    setup, _ = setup
    receiver = ReceiverConfig(estimator=estimator)
    clutter = Clutter(setup.extras, np.zeros(setup.extras.valid.shape))
    heard = [
        measure(setup.paths, 2, 0.3, RadioConfig(), receiver, clutter=what, rng=np.random.default_rng(2))
        for what in (None, clutter)
    ]
    assert len(heard[1][0]) > len(heard[0][0]) + 10
    assert (heard[1][1].path < setup.paths.num_paths).all()
    assert (heard[1][1].path == -1).sum() > (heard[0][1].path == -1).sum() + 5


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["extras.diffuse=true"], "extras.diffuse: no wall scatters"),
        (["extras.diffraction=true", "channel=image_source"], "give channel = 'traced'"),
    ],
)
def test_what_nobody_could_trace_is_refused(settings, words):
    spec = load_spec(PIPELINE, ["cycles=2", *settings])
    with pytest.raises(ConfigError, match=words):
        prepare_setup(load_scene("paper_room"), spec, rng=np.random.default_rng(7))
