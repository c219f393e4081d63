"""Paths that Sionna's own `PathSolver` finds in a scene file, under this package's path identities.

`TracedChannel` gives Sionna's image method the candidates that it should look at, and meshes that it built in memory.
Here nothing of that is used: Sionna loads the file, shoots its rays, and says which primitives of which objects it met.
What is left is bookkeeping, so that the same paths on both sides prove the file and the identities.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.channel.path_composition import compose_paths
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.channel.traced.path_geometry import traced_geometry
from rislam_rt.channel.traced.tracer_startup import start_tracer
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import TraceError
from rislam_rt.model import Paths, RadioConfig, Scene, Trajectory


class SolverLeg(NamedTuple):
    """One specular leg of one cycle as Sionna's `PathSolver` reports it."""

    cycle: int
    walls: tuple[int, ...]
    tau: float
    field: complex
    """Complex amplitude without carrier phase."""
    vertices: Floats
    """(D, 3) [m]."""


def solve_file(
    file: str | Path, scene: Scene, radio: RadioConfig, trajectory: Trajectory, depth: int, samples: int
) -> Paths:
    """All paths that Sionna's `PathSolver` finds in a scene file of `scene`, for `compare_paths`.

    `samples` rays are shot from every device. A scatterer is a receiver to both of the agent's ends, and its paths are
    those legs joined. The panel is left out: it lies on its host's face, where Sionna's rays do not start.

    Raises
    ------
    TraceError
        The file's objects are not the scene's reflectors.
    SetupError
        The machine lacks something that the tracer needs.
    """
    start_tracer()
    scene = replace(scene, ris=None)
    walls = build_walls(scene)
    tracer_scene, number_of = _load(Path(file), scene, radio)
    points = scene.landmark_positions
    ends = {"tx": trajectory.tx, "rx": trajectory.rx}
    rows: dict[tuple[str, int], list[SolverLeg]] = {(end, far): [] for end in ends for far in range(len(points) + 1)}
    for n, point in enumerate([trajectory.rx[0], *points]):
        tracer_scene.add(_receiver(f"far-{n}", point))
    for cycle in range(len(trajectory)):
        for end, place in ends.items():
            tracer_scene.get("device").position = place[cycle].tolist()
            tracer_scene.get("far-0").position = trajectory.rx[cycle].tolist()
            for far, row in _solve(tracer_scene, cycle, depth, samples, number_of, walls):
                rows[end, far].append(row)
    direct = _legs(rows["tx", 0], trajectory.tx, trajectory.rx, depth, radio)
    legs = {
        end: [
            _legs(rows[end, n + 1], place, np.broadcast_to(p, place.shape), depth, radio) for n, p in enumerate(points)
        ]
        for end, place in ends.items()
    }
    source = "traced by Sionna's PathSolver from a scene file"
    return compose_paths(scene, radio, walls, depth, direct, legs["tx"], legs["rx"], source)


def _load(file: Path, scene: Scene, radio: RadioConfig) -> tuple[Any, dict[int, int]]:
    """Load a scene file in Sionna; also the number of each reflector's first triangle, by the number of its object."""
    import sionna.rt as rt

    tracer_scene = rt.load_scene(str(file), merge_shapes=False)
    tracer_scene.frequency = radio.carrier
    tracer_scene.tx_array = tracer_scene.rx_array = rt.PlanarArray(
        num_rows=1, num_cols=1, pattern="iso", polarization="V"
    )
    first, number_of = 0, {}
    for reflector in scene.reflectors:
        thing = tracer_scene.objects.get(reflector.name)
        if thing is None or thing.mi_mesh.primitive_count() != len(reflector.faces):
            raise TraceError(f"{file}: no object '{reflector.name}' of {len(reflector.faces)} faces; export it again")
        number_of[int(thing.object_id)] = first
        first += len(reflector.faces)
    tracer_scene.add(rt.Transmitter("device", [0.0, 0.0, 0.0]))
    return tracer_scene, number_of


def _receiver(name: str, point: Floats) -> Any:
    """Sionna receiver at a point (3,) [m]."""
    import sionna.rt as rt

    return rt.Receiver(name, point.tolist())


def _solve(
    tracer_scene: Any, cycle: int, depth: int, samples: int, number_of: dict[int, int], walls: Walls
) -> list[tuple[int, SolverLeg]]:
    """Pairs (far end, leg) of all paths that Sionna's own path solver finds from one position of a device."""
    import sionna.rt as rt

    paths = rt.PathSolver(deterministic=True)(
        tracer_scene, max_depth=depth, samples_per_src=samples, max_num_paths_per_src=10 * samples, los=True,
        specular_reflection=True, diffuse_reflection=False, refraction=False, diffraction=False,
    )  # fmt: skip
    tau = np.array(paths.tau, dtype=np.float64)[:, 0]
    field = (np.array(paths.a[0], dtype=np.float64) + 1j * np.array(paths.a[1]))[:, 0, 0, 0]
    events, objects, primitives = (
        np.array(part, dtype=np.int64).reshape(depth, *tau.shape)
        for part in (paths.interactions, paths.objects, paths.primitives)
    )
    vertices = np.array(paths.vertices, dtype=np.float64).reshape(depth, *tau.shape, 3)
    found = []
    for far, p in np.argwhere(tau >= 0.0):
        steps = np.flatnonzero(events[:, far, p])
        met = [(int(objects[step, far, p]), int(primitives[step, far, p])) for step in steps]
        if all(thing in number_of for thing, _ in met):  # what only hides reflects nothing
            sequence = tuple(int(walls.wall_of_triangle[number_of[thing] + t]) for thing, t in met)
            row = SolverLeg(cycle, sequence, float(tau[far, p]), complex(field[far, p]), vertices[:, far, p])
            found.append((int(far), row))
    return found


def _legs(rows: list[SolverLeg], device: Floats, far: Floats, depth: int, radio: RadioConfig) -> SpecularLegs:
    """Arrange the path solver's legs by cycle and wall sequence (K, S); of two alike in one cycle the first counts."""
    first = {(row.cycle, row.walls): row for row in reversed(rows)}
    columns = sorted({walls for _, walls in first}, key=lambda walls: (len(walls), walls))
    table = np.full((len(columns), depth), -1)
    for number, walls in enumerate(columns):
        table[number, : len(walls)] = walls
    cycle = np.array([row.cycle for row in first.values()], dtype=np.int64)
    column = np.array([columns.index(row.walls) for row in first.values()], dtype=np.int64)
    length = np.array([row.tau for row in first.values()]) * SPEED_OF_LIGHT
    field: Complexes = np.array([row.field for row in first.values()], dtype=np.complex128)
    vertices = np.array([row.vertices for row in first.values()]).reshape(-1, depth, 3)
    vertices = np.where((table[column] >= 0)[..., None], vertices, 0.0)
    geometry = traced_geometry(table[column], device[cycle], far[cycle], vertices)
    place, shape = (cycle, column), (len(device), len(columns))

    def dense(part: Any) -> Any:
        values = np.zeros(shape + part.shape[1:], dtype=part.dtype)
        values[place] = part
        return values

    return SpecularLegs(
        walls=table, valid=dense(np.ones(len(cycle), dtype=np.bool_)), length=dense(length),
        at_device=dense(geometry.at_device), at_far_end=dense(geometry.at_far_end),
        coefficient=dense(field * 4.0 * np.pi * length / radio.wavelength), vertices=dense(geometry.vertices),
    )  # fmt: skip
