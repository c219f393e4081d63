"""A room: reflecting meshes, point scatterers, at most one panel, and the agent's true motion."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, freeze, show_point
from rislam_rt.errors import SceneError
from rislam_rt.model.picture import Plan, html_with, outline
from rislam_rt.model.ris import RisPanel
from rislam_rt.model.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class Material:
    """Either a constant reflection coefficient at every angle, or a slab of an ITU-R P.2040 material."""

    reflection: float | None = None
    """R in (0, 1]: amplitude, the same for every angle and polarisation."""
    itu: str | None = None
    """Name in ITU-R P.2040, e.g. `concrete`."""
    thickness: float = 0.1
    """Thickness [m] of the slab; unused with a constant R."""

    def __post_init__(self) -> None:
        if (self.reflection is None) == (self.itu is None):
            raise SceneError("material: give either 'reflection' or 'itu'")
        if self.reflection is not None and not 0.0 < self.reflection <= 1.0:
            raise SceneError(f"material.reflection: {self.reflection} received; give a number in (0, 1]")
        if not self.thickness > 0.0:
            raise SceneError(f"material.thickness_m: {self.thickness} received; give a positive length")


@dataclass(frozen=True, slots=True, eq=False)
class Reflector:
    """A smooth opaque mesh; it reflects on both sides. Each plane it has is a wall of its own."""

    name: str
    vertices: Floats
    """(V, 3) [m]."""
    faces: Any
    """(F, 3) indices into `vertices`."""
    material: Material

    def __post_init__(self) -> None:
        _freeze_mesh(self, f"reflector '{self.name}'")

    @property
    def triangles(self) -> Floats:
        """(F, 3, 3) [m]: face, corner, xyz."""
        return self.vertices[self.faces]


@dataclass(frozen=True, slots=True, eq=False)
class Shade:
    """An opaque mesh that hides what lies behind it and reflects nothing."""

    vertices: Floats
    """(V, 3) [m]."""
    faces: Any
    """(F, 3) indices into `vertices`."""
    name: str = ""
    """What it is called where it stands alone; one of a scatterer has the scatterer's name."""

    def __post_init__(self) -> None:
        _freeze_mesh(self, f"shade '{self.name}'" if self.name else "shade")

    @property
    def triangles(self) -> Floats:
        """(F, 3, 3) [m]: face, corner, xyz."""
        return self.vertices[self.faces]


@dataclass(frozen=True, slots=True, eq=False)
class Scatterer:
    """A small object that re-radiates in all directions. It shades nothing unless it has a shade."""

    name: str
    position: Floats
    """(3,) [m]."""
    rcs: float
    """Radar cross-section [m^2]; where `law` makes it depend on the carrier or on directions, its nominal value."""
    radius: float | None = None
    """Radius [m] of a sphere or cylinder, if it is one."""
    law: str = "constant"
    """`constant`: `rcs` for all directions; `mie`: a sphere's exact value at the carrier; `cylinder`: that of a
    cylinder by physical optics, for each pair of directions."""
    height: float | None = None
    """Length [m] of a cylinder along its axis."""
    axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector along a cylinder."""
    shade: Shade | None = None
    """What it hides; its own centre it does not hide."""

    def __post_init__(self) -> None:
        freeze(self, "position", np.float64, (3,))
        freeze(self, "axis", np.float64, (3,))
        place = f"scatterer '{self.name}'"
        if not self.rcs > 0.0:
            raise SceneError(f"{place}: cross-section {self.rcs} m^2 received; give a positive one")
        if self.law not in ("constant", "mie", "cylinder"):
            raise SceneError(f"{place}: law '{self.law}' received; give 'constant', 'mie' or 'cylinder'")
        if self.law == "mie" and (self.radius is None or self.height is not None):
            raise SceneError(f"{place}: the Mie series is a sphere's; give a radius and no height")
        if self.law == "cylinder" and (self.radius is None or self.height is None):
            raise SceneError(f"{place}: a cylinder needs a radius and a height; give both")
        if abs(np.linalg.norm(self.axis) - 1.0) > 1e-9:
            raise SceneError(f"{place}: axis {self.axis.tolist()} received; give a unit vector")


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The true room. Nothing in `slam/` or `design/` may see it."""

    name: str
    reflectors: tuple[Reflector, ...]
    scatterers: tuple[Scatterer, ...]
    ris: RisPanel | None
    agent: Trajectory
    digest: str = ""
    """SHA-256 over the scene file and its meshes; empty for a scene built in memory."""
    shades: tuple[Shade, ...] = ()
    """What hides and is neither wall nor landmark: clutter too small or too round to reflect like a plane."""

    def __repr__(self) -> str:
        size = " x ".join(f"{length:.3g}" for length in self.bounds[1] - self.bounds[0])
        panel = "no panel"
        if self.ris is not None:
            spec = self.ris.spec
            panel = f"panel of {spec.rows} x {spec.cols} elements at {show_point(self.ris.center)} m"
        counts = f"{len(self.reflectors)} reflectors, {len(self.scatterers)} scatterers, {panel}"
        return f"Scene '{self.name}': {size} m, {counts}, {len(self.agent)} cycles"

    def _repr_html_(self) -> str:
        return html_with(repr(self), self.plan(("true way", self.agent.position)))

    def plan(self, *ways: tuple[str, Floats]) -> Plan:
        """The room from above, with named courses (K, 3) [m] in it."""
        edges = outline((reflector.vertices, reflector.faces) for reflector in self.reflectors)
        return Plan(self.bounds, edges, list(zip(self.landmarks, self.landmark_positions, strict=True)), ways)

    @property
    def landmarks(self) -> tuple[str, ...]:
        """Names in the order of landmark numbers: scatterers first, then the panel."""
        return tuple(s.name for s in self.scatterers) + ((self.ris.name,) if self.ris else ())

    @property
    def landmark_positions(self) -> Floats:
        """(num_landmarks, 3) [m], in the order of `landmarks`."""
        points = [s.position for s in self.scatterers] + ([self.ris.center] if self.ris else [])
        return np.array(points, dtype=np.float64).reshape(-1, 3)

    @property
    def bounds(self) -> Floats:
        """(2, 3) [m]: lowest and highest corner of all reflectors."""
        points = np.concatenate([r.vertices for r in self.reflectors]) if self.reflectors else np.zeros((1, 3))
        return np.stack([points.min(axis=0), points.max(axis=0)])


def _freeze_mesh(mesh: Any, place: str) -> None:
    """Check and freeze `vertices` and `faces`."""
    freeze(mesh, "vertices", np.float64, (None, 3))
    freeze(mesh, "faces", np.int64, (None, 3))
    if len(mesh.faces) == 0:
        raise SceneError(f"{place}: the mesh has no faces")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise SceneError(f"{place}: a face names vertex {int(mesh.faces.max())} of {len(mesh.vertices)}")
