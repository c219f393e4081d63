"""The whole chain on a stretch of the paper's room, traced: what `make demo` does, thirty-two cycles past the panel."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.model import PathKind
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
CYCLES = 32


@pytest.fixture(scope="module")
def chain():
    """Room, specification, and a function that runs it anew."""
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [f"cycles={CYCLES}"])
    room = load_scene(ROOT / "scenes" / "paper_room")
    room = replace(room, agent=room.agent[250 : 250 + CYCLES])
    return room, spec, lambda: run_slam(room, spec, rng=np.random.default_rng(spec.seed))


@pytest.fixture(scope="module")
def result(chain):
    return chain[2]()


def test_all_classes_are_traced(result):
    counts = {kind: int(result.paths.valid[:, result.paths.kind == kind].sum(axis=1).min()) for kind in PathKind}
    # a box at depth 2: 6 + 18 wall returns; the other classes are complete by the path comparison's own tests
    assert counts[PathKind.LOS] == counts[PathKind.PS] == counts[PathKind.RIS] == 1
    assert counts[PathKind.VT] == 24
    assert counts[PathKind.VS] > 60
    assert counts[PathKind.VRIS] > 40
    assert result.paths.source.startswith("traced")


@pytest.fixture(scope="module")
def scores(result):
    return summarise(result)["schemes"]


def test_agent_learns_how_it_moves(result):
    """Errors over the start's own, against the start carried on at the speed that was told (0.01 m/s off an axis)."""
    truth = result.scene.agent
    for scheme in result.schemes.values():
        start = scheme.given.inputs.start
        told = start.position + np.outer(truth.elapsed, start.velocity)
        shift = truth.position + start.position - truth.position[0]
        error, drift = (np.sqrt(np.mean(np.sum((way - shift) ** 2, axis=1))) for way in (scheme.position, told))
        assert error < 0.5 * drift
        assert np.isfinite(scheme.covariance).all()
        assert (np.linalg.eigvalsh(scheme.covariance) > -1e-12).all()


def test_nothing_measured_tells_where_the_start_was(result, scores):
    """Neither the deviations of the filter nor the bound go below the start's 0.01 m an axis; both are float64."""
    for name, scheme in result.schemes.items():
        assert np.sqrt(np.einsum("kii->ki", scheme.covariance)[:, :2].min()) > 0.01 * (1.0 - 1e-6)
        assert scores[name]["bound_m"] > np.sqrt(2.0) * 0.01 * (1.0 - 1e-6)


def test_panel_and_sphere_are_found(scores):
    """Within what a Gaussian of three axes, whose RMS the bound is, exceeds in one of 10^4 draws, and 0.02 m."""
    for scheme in scores.values():
        for landmark in scheme["landmarks"].values():
            assert landmark["final_m"] < 2.7 * landmark["bound_m"] + 0.02
        assert scheme["landmarks"]["ris"]["cycles_identified"] >= 10
        assert not scheme["diverged"]
        assert "diverged" not in scheme["outcomes"]


def test_designed_codes_light_the_panel(result):
    """By 6 dB at least over the last second; 36 elements of four levels gain 15 dB over random codes on average."""
    direct = result.paths.kind == PathKind.RIS
    level = {name: np.median(np.abs(scheme.gain[-10:, direct])) for name, scheme in result.schemes.items()}
    assert level["optimized"] > 2.0 * level["random"]
