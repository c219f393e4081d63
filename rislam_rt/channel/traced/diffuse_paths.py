"""Diffuse paths: those that Sionna finds by scattering and diffraction, beside the specular ones of the channel.

Such paths have no identity that lasts from cycle to cycle and no wall sequence of their own, so they do not enter
`Paths`: one flat list over the cycles holds them. They are what Sionna's `PathSolver` finds, position by position.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, freeze
from rislam_rt.channel.traced.float32_limits import room_center
from rislam_rt.channel.traced.tracer_startup import start_tracer
from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.angles import rotation_z, unit
from rislam_rt.model import PathKind, Paths, RadioConfig, Scene, Trajectory
from rislam_rt.ranges import Count, Probability, check_ranges


class DiffuseKind(IntEnum):
    """Whether a diffuse path was scattered by a rough wall or diffracted by an edge."""

    DIFFUSE = 0
    DIFFRACTED = 1


@dataclass(frozen=True, slots=True)
class DiffuseConfig:
    """Settings of diffuse scattering and diffraction in the tracer, all off by default."""

    scattering: Probability = 0.0
    """S in [0, 1]: share of the reflected field that walls scatter (Lambertian) whose material says nothing of it; 0 is
    off. What they reflect specularly would lose `sqrt(1 - S^2)` at every bounce, which `Paths` of the same walls do not
    know; of a material's own `scattering` they do."""
    diffraction: bool = False
    """Edges between walls, and free ones, diffract (uniform theory of diffraction, first order)."""
    depth: Count = 1
    """Largest number of interactions."""
    samples: Count = 10_000
    """Rays shot from every Tx position; each may end in a scattered path."""
    seed: int = 1
    """Seed of the rays' directions."""

    def __post_init__(self) -> None:
        check_ranges("extras", self)


@dataclass(frozen=True, slots=True, eq=False)
class DiffusePaths:
    """N scattered or diffracted paths of all cycles, in one flat list."""

    cycle: Integers
    """(N,) number of the cycle."""
    kind: Integers
    """(N,) values of `DiffuseKind`; a path that was both scattered and diffracted counts as diffracted."""
    tau: Floats
    """(N,) [s] delay."""
    departure: Floats
    """(N, 3) unit vector away from the Tx."""
    arrival: Floats
    """(N, 3) unit vector from the Rx towards the arriving ray."""
    gain: Complexes
    """(N,) complex gain, carrier phase included; the phases of scattered paths are random by nature."""
    vertices: Floats
    """(N, D, 3) [m] interaction points, zero beyond the last."""
    source: str = "traced, no analytic twin"

    def __post_init__(self) -> None:
        count = len(np.asarray(self.cycle))
        freeze(self, np.int64, cycle=(count,), kind=(count,))
        freeze(self, np.float64, tau=(count,), departure=(count, 3), arrival=(count, 3))
        freeze(self, np.complex128, gain=(count,))
        freeze(self, np.float64, vertices=(count, None, 3))

    def __len__(self) -> int:
        return len(self.cycle)


def trace_diffuse_paths(
    scene: Scene, radio: RadioConfig, trajectory: Trajectory, config: DiffuseConfig
) -> DiffusePaths:
    """Scattered and diffracted paths from Tx to Rx at every cycle, one solve each (0.1 s and more).

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    none, whole, points = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    nothing = none.astype(np.complex128)
    solved = [DiffusePaths(whole, whole, none, points, points, nothing, np.zeros((0, config.depth, 3)))]
    own = any(reflector.material.scattering > 0.0 for reflector in scene.reflectors)
    if config.scattering > 0.0 or config.diffraction or own:
        start_tracer()
        origin = room_center(scene)
        tracer_scene = _scattering_scene(scene, radio.carrier, origin, config.scattering)
        for cycle, (tx, rx) in enumerate(zip(trajectory.tx - origin, trajectory.rx - origin, strict=True)):
            solved += _solve(tracer_scene, cycle, tx, rx, origin, config, config.scattering > 0.0 or own)
    names = ("cycle", "kind", "tau", "departure", "arrival", "gain", "vertices")
    columns: list[Any] = [np.concatenate([getattr(one, name) for one in solved]) for name in names]
    found = DiffusePaths(*columns)
    antennas = np.sqrt(radio.tx_gain * radio.rx_gain) * np.exp(-2j * np.pi * radio.carrier * found.tau)
    return replace(found, gain=found.gain * antennas)


def _scattering_scene(scene: Scene, carrier: float, origin: Floats, scattering: float) -> Any:
    """Sionna scene of the room with scattering walls; corners of one material are joined, so that edges diffract."""
    import sionna.rt as rt

    from rislam_rt.channel.traced.radio_materials import rough_material
    from rislam_rt.channel.traced.tracer_scene import build_mesh

    tracer_scene = rt.load_scene()
    tracer_scene.frequency = carrier
    tracer_scene.tx_array = tracer_scene.rx_array = rt.PlanarArray(
        num_rows=1, num_cols=1, pattern="iso", polarization="V"
    )
    walls, absorber = build_walls(scene), rt.AbsorberRadioMaterial("shade")
    shades = {f"shade-{one.name}": one.shade for one in scene.scatterers if one.shade is not None}
    shades |= {f"shade-alone-{index}": shade for index, shade in enumerate(scene.occluders)}
    objects = []
    for name, shade in shades.items():
        mesh = build_mesh(name, shade.triangles - origin)
        objects.append(rt.SceneObject(mesh, name, radio_material=absorber))
    for number, material in enumerate(dict.fromkeys(walls.material)):
        wanted = np.array([m == material for m in walls.material])[walls.wall_of_triangle]
        mesh = build_mesh(f"walls-{number}", walls.triangles[wanted] - origin)
        rough = rough_material(material, number, scattering)
        objects.append(rt.SceneObject(mesh, f"walls-{number}", radio_material=rough, remove_duplicate_vertices=True))
    tracer_scene.add([*objects, rt.Transmitter("tx", [0.0, 0.0, 0.0]), rt.Receiver("rx", [0.0, 0.0, 0.0])])
    return tracer_scene


def _solve(
    tracer_scene: Any, cycle: int, tx: Floats, rx: Floats, origin: Floats, config: DiffuseConfig, diffuse: bool
) -> list[DiffusePaths]:
    """Scattered and diffracted paths that Sionna finds in a cycle, if any; Tx and Rx (3,) [m] are from `origin`."""
    import sionna.rt as rt

    tracer_scene.get("tx").position, tracer_scene.get("rx").position = tx.tolist(), rx.tolist()
    paths = rt.PathSolver(deterministic=True)(
        tracer_scene, max_depth=config.depth, max_num_paths_per_src=10 * config.samples, samples_per_src=config.samples,
        los=False, specular_reflection=True, diffuse_reflection=diffuse, refraction=False,
        diffraction=config.diffraction, edge_diffraction=config.diffraction, seed=config.seed,
    )  # fmt: skip
    tau = np.array(paths.tau, dtype=np.float64).reshape(-1)
    if tau.size == 0:
        return []
    events = np.array(paths.interactions, dtype=np.int64).reshape(config.depth, -1)
    diffracted = (events == rt.InteractionType.DIFFRACTION).any(axis=0)
    keep = np.flatnonzero((tau >= 0.0) & (diffracted | (events == rt.InteractionType.DIFFUSE).any(axis=0)))
    bounces = (events != rt.InteractionType.NONE).sum(axis=0)[keep]
    vertices = np.moveaxis(np.array(paths.vertices, dtype=np.float64).reshape(config.depth, -1, 3), 0, 1)[keep] + origin
    vertices[np.arange(config.depth) >= bounces[:, None]] = 0.0
    first, last = vertices[:, 0], vertices[np.arange(len(keep)), bounces - 1]
    gain = np.empty(len(tau), dtype=np.complex128)
    gain.real, gain.imag = (np.array(part).ravel() for part in paths.a)
    kind = np.where(diffracted, DiffuseKind.DIFFRACTED, DiffuseKind.DIFFUSE)
    away, back = unit(first - origin - tx), unit(last - origin - rx)
    return [DiffusePaths(np.full(len(keep), cycle), kind[keep], tau[keep], away, back, gain[keep], vertices)]


CELLS = 2.0
"""Summing cells to a resolution cell, along delay and along each direction cosine."""


def as_paths(extras: DiffusePaths, trajectory: Trajectory, radio: RadioConfig) -> Paths:
    """Sum diffuse paths (scattered and diffracted) within half a resolution cell into one path each, cycle by cycle.

    These paths have no identity: a column means nothing from one cycle to the next.

    Gains add up, carrier phases included; delay and directions are the mean by power. The kind is `VT`, for want of
    another: they came over walls alone.
    """
    groups, cycle = _cells(extras, trajectory, radio)
    count, cycles = len(cycle), len(trajectory)
    power = np.abs(extras.gain) ** 2
    total = np.maximum(np.bincount(groups, power, count), np.finfo(np.float64).tiny)
    gain = np.bincount(groups, extras.gain.real, count) + 1j * np.bincount(groups, extras.gain.imag, count)

    def mean(values: Floats) -> Floats:
        return np.bincount(groups, power * values, count) / total

    first = np.searchsorted(cycle, np.arange(cycles))
    column = np.arange(count) - first[cycle]
    width = int(column.max(initial=-1)) + 1

    def dense(values: np.ndarray) -> np.ndarray:
        table = np.zeros((cycles, width, *values.shape[1:]), dtype=values.dtype)
        table[cycle, column] = values
        return table

    return Paths(
        kind=np.full(width, PathKind.VT),
        landmark=np.full(width, -1),
        tx_walls=np.full((width, 1), -1),
        rx_walls=np.full((width, 1), -1),
        valid=dense(np.ones(count, dtype=np.bool_)),
        tau=dense(mean(extras.tau)),
        departure=dense(unit(np.stack([mean(axis) for axis in extras.departure.T], axis=-1))),
        arrival=dense(unit(np.stack([mean(axis) for axis in extras.arrival.T], axis=-1))),
        gain=dense(gain),
        vertices=dense(np.stack([mean(axis) for axis in extras.vertices[:, 0].T], axis=-1)[:, None]),
        num_vertices=np.ones(width, dtype=np.int64),
        walls=(),
        landmarks=(),
        source=extras.source,
    )


def _cells(extras: DiffusePaths, trajectory: Trajectory, radio: RadioConfig) -> tuple[Integers, Integers]:
    """Number (N,) of the cell of delay and angle of each diffuse path, and each cell's cycle (C,), ascending."""
    array = radio.array
    body = np.einsum("ni,nij->nj", extras.arrival, rotation_z(trajectory.heading[extras.cycle]))
    widths = CELLS * np.array([radio.bandwidth, array.rows * array.spacing, array.cols * array.spacing])
    place = np.column_stack([extras.tau, body[:, :2]]) * widths
    keys = np.column_stack([extras.cycle, np.floor(place).astype(np.int64), body[:, 2] >= 0.0])
    cells, groups = np.unique(keys, axis=0, return_inverse=True)
    return groups.ravel(), cells[:, 0]
