"""Rooms in memory for the channel's tests.

paper()      the paper's room: 6 x 6 x 3 m box, sphere at (2, 1, 1), panel at the middle of the ceiling
l_shape()    a 6 x 6 x 3 m box without its corner x > 3, y > 3: two re-entrant walls
parted()     the box with a partition at x = 3 that has a doorway, and a desk
panels()     the box with two panels on the ceiling and one on a wall, of three sizes
"""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.model import Body, Material, Reflector, RisPanel, RisSpec, Scatterer, Scene, Trajectory, join_panels

PLAIN = Material(reflection=0.85)


def polygon(name, corners, material=PLAIN):
    """A convex polygon as a fan of triangles."""
    fan = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)])
    return Reflector(name, np.array(corners, dtype=float), fan, material)


def box(low, high, prefix="", material=PLAIN):
    """The six faces of a box."""
    (x, y, z), (X, Y, Z) = low, high
    faces = {
        "floor": [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z)],
        "ceiling": [(x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)],
        "wall_x0": [(x, y, z), (x, Y, z), (x, Y, Z), (x, y, Z)],
        "wall_x1": [(X, y, z), (X, Y, z), (X, Y, Z), (X, y, Z)],
        "wall_y0": [(x, y, z), (X, y, z), (X, y, Z), (x, y, Z)],
        "wall_y1": [(x, Y, z), (X, Y, z), (X, Y, Z), (x, Y, Z)],
    }
    return tuple(polygon(prefix + name, corners, material) for name, corners in faces.items())


def panel(center=(3.0, 3.0, 3.0), rows=6, cols=6, name="ris", **options):
    """The paper's panel, facing down."""
    spec = RisSpec(
        rows, cols, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), **options
    )
    return RisPanel(spec, np.array(center), "ceiling", name)


def at(positions, tx=(-0.04, -0.03, 0.01), rx=(0.04, 0.03, -0.01)):
    """Poses at rest (K, 3) without heading, Tx and Rx at fixed offsets in the room's axes."""
    positions = np.atleast_2d(np.array(positions, dtype=float))
    count = len(positions)
    body = Body(np.array(tx, dtype=float), np.array(rx, dtype=float))
    return Trajectory(np.arange(float(count)), positions, np.zeros((count, 3)), np.zeros(count), body)


SPHERE = Scatterer("sphere", np.array([2.0, 1.0, 1.0]), np.pi * 0.05**2, 0.05)


def scene(reflectors, scatterers=(SPHERE,), ris=None, name="room"):
    """A scene whose agent rests at (0.5, 0.7, 0.5)."""
    return Scene(name, tuple(reflectors), tuple(scatterers), ris, at([0.5, 0.7, 0.5]))


def paper(material=PLAIN, **options):
    return scene(box((0, 0, 0), (6, 6, 3), material=material), ris=panel(**options), name="paper")


def l_shape():
    outline = [(0, 0), (6, 0), (6, 3), (3, 3), (3, 6), (0, 6)]
    sides = [
        polygon(f"side{i}", [(*p, 0), (*q, 0), (*q, 3), (*p, 3)])
        for i, (p, q) in enumerate(zip(outline, outline[1:] + outline[:1], strict=True))
    ]
    parts = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    caps = [
        Reflector(name, np.array([(*p, z) for p in outline], dtype=float), parts, PLAIN)
        for name, z in (("floor", 0.0), ("ceiling", 3.0))
    ]
    return scene([*sides, *caps], ris=panel(center=(1.5, 1.5, 3.0)), name="l_shape")


def parted():
    partition = [
        polygon("left", [(3, 0, 0), (3, 2.5, 0), (3, 2.5, 3), (3, 0, 3)]),
        polygon("right", [(3, 3.5, 0), (3, 6, 0), (3, 6, 3), (3, 3.5, 3)]),
        polygon("lintel", [(3, 2.5, 2.1), (3, 3.5, 2.1), (3, 3.5, 3), (3, 2.5, 3)]),
    ]
    desk = box((1.0, 4.0, 0.7), (2.2, 4.8, 0.75), "desk_")
    return scene([*box((0, 0, 0), (6, 6, 3)), *partition, *desk], ris=panel(center=(1.5, 3.0, 3.0)), name="parted")


def panels():
    upright = RisSpec(5, 3, np.array([0.015, 0.015]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    three = (
        panel(center=(2.0, 3.0, 3.0), name="a"), panel(center=(2.4, 3.1, 3.0), rows=4, cols=8, name="b"),
        RisPanel(upright, np.array([6.0, 2.0, 1.5]), "wall_x1", "c"),
    )  # fmt: skip
    return scene(box((0, 0, 0), (6, 6, 3)), ris=join_panels(three))


@pytest.fixture(scope="session")
def rooms():
    """The builders above."""
    return SimpleNamespace(
        polygon=polygon, box=box, panel=panel, at=at, scene=scene, paper=paper, l_shape=l_shape, parted=parted,
        panels=panels,
    )  # fmt: skip
