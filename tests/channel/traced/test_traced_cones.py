"""Cones rule out nothing that exists, and let rooms with round things through."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_paths, random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel, shortest_segment, wall_sequences
from rislam_rt.model import Material, RadioConfig, Reflector
from rislam_rt.scene import load_scene
from rislam_rt.scene.shapes import sphere_mesh

SCENES = Path(__file__).parents[3] / "scenes"


def identities(paths):
    """Every path of every cycle."""
    return {(int(k), *paths.identity(p)) for k, p in np.argwhere(paths.valid)}


def with_ball(scene):
    """A sphere of 320 facets on the floor's side of the room."""
    mesh = sphere_mesh(np.array([3.8, 2.1, 0.6]), 0.35)
    ball = Reflector("ball", mesh.vertices, mesh.faces, Material(reflection=0.5))
    return replace(scene, reflectors=(*scene.reflectors, ball))


@pytest.mark.parametrize("seed", range(10))
def test_a_ray_through_two_balls_meets_what_lies_on_it(seed):
    """Points of a ball about any point of a ray from the one through the other, beyond it, are never ruled out."""
    from rislam_rt.channel.traced.tracer_startup import start_tracer

    start_tracer()
    import mitsuba as mi

    from rislam_rt.channel.traced.cones import _meets

    rng = np.random.default_rng(seed)
    source, half, size = (rng.choice([0.0, 0.05, 0.7], 50) for _ in range(3))
    ways = rng.normal(size=(3, 50, 3))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    axis = 3.0 * rng.normal(size=(50, 3))
    start, through = source[:, None] * ways[0], axis + half[:, None] * ways[1]
    met = start + (1.0 + rng.exponential(2.0, 50))[:, None] * (through - start)
    target = met + size[:, None] * ways[2]
    slack = 1e-3 * (1.0 + np.abs(target).max())  # the sieve's margin: float32
    points = [mi.Vector3f(*(mi.Float(np.ascontiguousarray(c, dtype=np.float32)) for c in p.T)) for p in (target, axis)]
    sizes = [mi.Float(s.astype(np.float32)) for s in (size + slack, source, half + slack)]
    assert np.array(_meets(*points, *sizes)).all()
    # and of targets anywhere most are ruled out where balls are small
    small = [mi.Float(np.full(50, 1e-2, dtype=np.float32))] * 3
    astray = mi.Vector3f(*(mi.Float(np.ascontiguousarray(c, dtype=np.float32)) for c in (-np.abs(axis) - 1.0).T))
    ahead = mi.Vector3f(*(mi.Float(np.ascontiguousarray(c, dtype=np.float32)) for c in (np.abs(axis) + 1.0).T))
    assert not np.array(_meets(astray, ahead, *small)).any()


@pytest.mark.parametrize(
    ("name", "near"),
    [
        *((name, False) for name in ("l_room", "office", "tilted_room", "large_hall", "ball")),
        *(pytest.param(name, True, marks=pytest.mark.slow) for name in ("l_room", "office", "tilted_room")),
        *((name, True) for name in ("large_hall", "ball")),
    ],
)
def test_cones_lose_nothing(rooms, monkeypatch, name, near):
    scene = with_ball(rooms.paper()) if name == "ball" else load_scene(SCENES / name)
    depth = 3 if name in ("l_room", "tilted_room") else 2
    trajectory = random_poses(scene, 4, rng=np.random.default_rng(6))
    if near:  # positions that share balls
        spread = 0.02 * np.random.default_rng(0).normal(size=(4, 3))
        trajectory = rooms.at(trajectory.position[0] + spread)
    channel = TracedChannel(scene, RadioConfig(), depth)
    every = channel.paths(trajectory)
    assert every.source == "traced, refined, all wall sequences"
    monkeypatch.setattr(wall_sequences, "MANY", 0)
    narrowed = channel.paths(trajectory)
    assert narrowed.source == "traced, refined, wall sequences in cones"
    assert len(identities(every)) > 50
    assert identities(narrowed) == identities(every)


def test_a_round_body_in_a_room(rooms, monkeypatch):
    """320 facets: cones and beams, two ways that share nothing, against each other and against all sequences."""
    scene = with_ball(rooms.paper())
    trajectory = random_poses(scene, 4, rng=np.random.default_rng(1))
    monkeypatch.setattr(wall_sequences, "MANY", 10_000)
    traced = TracedChannel(scene, RadioConfig(), 2).paths(trajectory)
    beams, every = (
        ImageSourceChannel(scene, RadioConfig(), 2, how).paths(trajectory) for how in ("auto", "exhaustive")
    )
    assert identities(beams) == identities(every)
    report = compare_paths(traced, beams, scene, trajectory, shortest_segment=shortest_segment(scene))
    assert report.unexplained == 0
    assert report.searched == {
        "traced": "traced, refined, wall sequences in cones", "analytic": "image source, mirrored beams"
    }  # fmt: skip
    assert report.as_dict()["searched"] == report.searched
    assert any("ball" in beams.label(p) for p in range(beams.num_paths))
