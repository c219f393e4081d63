"""A random room from one integer seed: floor plan, shell, motion, furniture, scatterers, RIS panel, materials."""

import hashlib
from dataclasses import dataclass, replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import SceneError
from rislam_rt.model import Material, Reflector, RisPanel, Scatterer, Scene, Trajectory
from rislam_rt.scene.check import find_errors
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.random_rooms.furniture import FurniturePiece, PlacementLimits, draw_pieces
from rislam_rt.scene.random_rooms.landmarks import MOST, PLACES, SHARES, draw_panel, draw_scatterer, hidden_share
from rislam_rt.scene.random_rooms.random_floor_plan import SHAPES, area, draw_plan, extent
from rislam_rt.scene.random_rooms.random_motion import MOTIONS, Ways, draw_motion, draw_motion_profile
from rislam_rt.scene.random_rooms.shell import CEILINGS, build_shell, draw_roof

SHAPE_SHARES = (0.4, 0.2, 0.2, 0.2)
"""Shares of the random rooms that have each of `SHAPES`."""
REFLECTION, FURNITURE_REFLECTION = (0.2, 0.9), (0.2, 0.8)
"""Ranges of the reflection coefficients of a random room's walls and of its furniture."""
ALIKE = 0.5
"""Share of random rooms whose walls are all of one coefficient; else each has its own."""
MAX_PIECES, MAX_SCATTERERS = 6, 6
"""Most pieces of furniture and most scatterers of a random room."""
RADIUS = (0.03, 0.25)
"""Range [m] of the random scatterers' radii, log-uniform; each is a sphere of cross-section pi r^2."""
PER_PIECE = 3.0
"""Area [m^2] of the floor plan for each piece of furniture."""
PANEL, CEILING_PANEL = 0.7, 0.4
"""Share of random rooms with a RIS panel, and of panels in the ceiling."""
_TRIES = 200


@dataclass(frozen=True, slots=True, eq=False)
class RandomRoom:
    """A random room, and the classes that it belongs to, by which results are grouped."""

    scene: Scene
    seed: int
    shape: str
    """Shape of the floor plan, one of `SHAPES`."""
    ceiling: str
    """Form of the ceiling, one of `CEILINGS`."""
    motion: str
    """Kind of the motion, one of `MOTIONS`."""
    size: float
    """Longest way [m] across the floor plan."""
    reflection: float
    """Mean reflection coefficient of walls and ceiling."""
    pieces: int
    """Number of pieces of furniture."""
    below: int
    """Number of scatterers below all of the motion."""
    hidden: int
    """Number of scatterers not seen over the straight line, because of furniture, from `MOST` of the motion."""
    panel: str
    """Where the RIS panel is: `none`, `ceiling` or `wall`."""
    speed: float
    """Mean speed [m/s] over the motion."""
    ways: Ways
    """How the motion lies in the room, one of `Ways`."""


def draw_room(seed: int, ways: Ways = "anyhow") -> RandomRoom:
    """Draw the random room of a seed with a motion of one of `Ways`, the same to the last bit on every call; it passes
    the scene check.

    Shape, ceiling, motion and whether there is a panel are drawn once; all else is drawn anew until it fits together,
    so that what is hard to fit is no rarer for it.

    Raises
    ------
    SceneError
        The seed is negative, or nothing fits.
    """
    if seed < 0:
        raise SceneError(f"seed: {seed} received; give a number that is not negative")
    rng = np.random.default_rng([seed, 0])
    shape, motion = str(rng.choice(SHAPES, p=SHAPE_SHARES)), str(rng.choice(MOTIONS))
    ceiling = str(rng.choice(CEILINGS if shape == "convex" else CEILINGS[:2]))
    panel = "none" if rng.uniform() >= PANEL else "ceiling" if rng.uniform() < CEILING_PANEL else "wall"
    for attempt in range(1, _TRIES):
        try:
            room = _attempt(seed, shape, ceiling, motion, ways, panel, rng=np.random.default_rng([seed, attempt]))
        except SceneError:
            continue
        if not find_errors(room.scene, room.scene.name):
            return room
    raise SceneError(f"seed: {seed}: nothing fits in {_TRIES} draws; take another seed")


def _attempt(
    seed: int, shape: str, ceiling: str, motion: str, ways: Ways, panel: str, *, rng: np.random.Generator
) -> RandomRoom:
    """One draw of a random room, from floor plan to materials; refused where nothing fits in."""
    outline = draw_plan(shape, rng=rng)
    roof = draw_roof(outline, ceiling, rng=rng)
    agent = draw_motion(outline, roof, draw_motion_profile(motion, ways, rng=rng), ways, rng=rng)
    ground = PlacementLimits(outline, roof, agent.position)
    most = min(MAX_PIECES, int(area(outline) / PER_PIECE))
    pieces = draw_pieces(ground, int(rng.integers(0, most + 1)), rng=rng)
    landmarks, ris = _landmarks(ground, pieces, panel, rng)
    shell = build_shell(outline, roof)
    reflectors = _reflectors(shell, pieces, rng)
    if not landmarks or (panel != "none" and ris is None):
        raise SceneError("no room for what is asked for; draw another plan")
    name = f"random_{seed}"
    scene = Scene(name, reflectors, tuple(landmarks), ris, agent)
    points = [scatterer.position for scatterer in landmarks]
    lowest = float(agent.position[:, 2].min())
    return RandomRoom(
        scene=replace(scene, digest=scene_digest(scene)), seed=seed, shape=shape, ceiling=ceiling, motion=motion,
        size=extent(outline), reflection=float(np.mean([r.material.reflection for r in reflectors[: len(shell)]])),
        pieces=len(pieces), below=sum(float(point[2]) < lowest for point in points),
        hidden=sum(hidden_share(point, agent.position, pieces) >= MOST for point in points), panel=panel,
        speed=float(np.linalg.norm(agent.velocity, axis=1).mean()), ways=ways,
    )  # fmt: skip


def _landmarks(
    ground: PlacementLimits, pieces: list[FurniturePiece], panel: str, rng: np.random.Generator
) -> tuple[list[Scatterer], RisPanel | None]:
    """Draw the landmarks of a random room: scatterers, as many as fit, and the RIS panel; screens join the pieces."""
    positions = np.zeros((0, 3))
    ris = None if panel == "none" else draw_panel(panel, ground, pieces, positions, rng=rng)
    marks = positions if ris is None else ris.center[None]
    for place in rng.choice(PLACES, p=SHARES, size=int(rng.integers(1, MAX_SCATTERERS + 1))):
        found = draw_scatterer(str(place), ground, pieces, np.concatenate([marks, positions]), rng=rng)
        if found is not None:
            positions = np.concatenate([positions, found[0][None]])
            pieces += found[1]
    radii = (float(np.exp(rng.uniform(*np.log(RADIUS)))) for _ in positions)
    spheres = enumerate(zip(positions, radii, strict=True))
    return [Scatterer(f"sphere_{k}", point, float(np.pi * r**2), r) for k, (point, r) in spheres], ris


def _reflectors(
    shell: dict[str, Mesh], pieces: list[FurniturePiece], rng: np.random.Generator
) -> tuple[Reflector, ...]:
    """Reflectors of a random room: its walls and furniture, with random materials."""
    common = float(rng.uniform(*REFLECTION))
    own = rng.uniform(*REFLECTION, size=len(shell))
    walls = np.full(len(shell), common) if rng.uniform() < ALIKE else own
    meshes = [*shell.items(), *((f"{piece.kind}_{number}", piece.mesh()) for number, piece in enumerate(pieces))]
    reflection = [*walls, *rng.uniform(*FURNITURE_REFLECTION, size=len(pieces))]
    return tuple(
        Reflector(name, *mesh, Material(reflection=float(share)))
        for (name, mesh), share in zip(meshes, reflection, strict=True)
    )


def scene_digest(scene: Scene) -> str:
    """SHA-256 over all numbers of a random room, made in memory; the scene of a file has that of its files."""
    digest = hashlib.sha256()

    def take(name: str, *arrays: Floats) -> None:
        digest.update(f"{name}\0".encode())
        for array in arrays:
            digest.update(np.ascontiguousarray(array).tobytes())

    for reflector in scene.reflectors:
        take(f"{reflector.name} {reflector.material}", reflector.vertices, reflector.faces)
    for scatterer in scene.scatterers:
        take(f"{scatterer.name} {scatterer.rcs!r}", scatterer.position)
    for panel in scene.panels:
        spec = panel.spec
        take(f"{spec.rows} {spec.cols} {spec.levels} {spec.element} {panel.host}", panel.center)
        take("panel", spec.normal, spec.up, spec.spacing)
    agent: Trajectory = scene.agent
    take("agent", agent.time, agent.position, agent.velocity, agent.heading)
    return digest.hexdigest()
