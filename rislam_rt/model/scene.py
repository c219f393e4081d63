"""A scene: reflecting meshes, occluders, point scatterers, RIS panels, and the agent's true motion."""

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Le, Lt

from rislam_rt.arrays import Floats, freeze, show_point
from rislam_rt.errors import SceneError
from rislam_rt.model.plan_view import PlanView, html_with, outline
from rislam_rt.model.ris import RisPanel, RisPanels
from rislam_rt.model.trajectory import Trajectory
from rislam_rt.ranges import NotNegative, Positive, Share, check_ranges

Reflection = Annotated[float, Ge(-1.0), Le(1.0)]

BODY_THICKNESS, BODY_LOSS, BODY_LEAST = 10.0, 0.1, 2e-3
"""Dielectric body that stands for a constant reflection coefficient R: its thickness [m]; the conductivity [S/m] that,
times its refractive index, keeps the back of it from being seen; and the least 1 - R."""


@dataclass(frozen=True, slots=True)
class Material:
    """Radio material of a reflector, one of four kinds: a reflection coefficient for every angle, one for each
    polarisation, a slab of an ITU-R P.2040 material, or a slab of a given permittivity and conductivity."""

    reflection: Share | None = None
    """Reflection coefficient R in (0, 1] of the amplitude, the same for every angle and polarisation."""
    itu: str | None = None
    """Name in ITU-R P.2040, e.g. `concrete`."""
    thickness: Positive = 0.1
    """Thickness [m] of the slab; unused with a constant R."""
    permittivity: Annotated[float, Ge(1.0)] | None = None
    """Real part of the relative permittivity, at least 1, the same at every carrier."""
    conductivity: NotNegative = 0.0
    """Conductivity [S/m] of the slab that `permittivity` describes."""
    reflection_te: Reflection | None = None
    """Reflection coefficient in [-1, 1] of the field across the plane of incidence (TE), the same at every angle."""
    reflection_tm: Reflection | None = None
    """Reflection coefficient in [-1, 1] of the field in the plane of incidence (TM); signs as Fresnel's: of a dense
    dielectric near normal incidence, TE is negative and TM positive."""
    scattering: Annotated[float, Ge(0.0), Lt(1.0)] = 0.0
    """Scattering coefficient S in [0, 1): share of the reflected field that the surface scatters in all directions; the
    mirrored ray keeps `sqrt(1 - S^2)` of its field."""

    def __post_init__(self) -> None:
        if sum(kind is not None for kind in (self.reflection, self.itu, self.permittivity, self.reflection_te)) != 1:
            raise SceneError("material: give one of 'reflection', 'itu', 'permittivity' and 'reflection_te'")
        if (self.reflection_te is None) != (self.reflection_tm is None):
            raise SceneError("material: give 'reflection_te' and 'reflection_tm' together")
        check_ranges("material", self, SceneError)
        if 0.0 in (self.reflection_te, self.reflection_tm):
            raise SceneError("material.reflection_te, reflection_tm: 0 received; give a number in [-1, 1], and not 0")
        if self.permittivity == 1.0 and self.conductivity == 0.0:
            raise SceneError("material.permittivity: 1 without conductivity is air; give more of either, or no mesh")
        if self.conductivity > 0.0 and self.permittivity is None:
            raise SceneError(f"material.conductivity: {self.conductivity} received; give 'permittivity' beside it")

    @property
    def is_slab(self) -> bool:
        """Whether a material reflects TE and TM differently: all but a constant `reflection`."""
        return self.reflection is None

    @property
    def level(self) -> float | None:
        """Constant |R| of a material, the mean of both polarisations; None for a slab, which has no constant one."""
        if self.reflection_te is not None and self.reflection_tm is not None:
            return 0.5 * (abs(self.reflection_te) + abs(self.reflection_tm))
        return self.reflection

    @property
    def specular_share(self) -> float:
        """Share of a material's reflected field that stays in the mirrored ray: `sqrt(1 - S^2)`."""
        return float(np.sqrt(1.0 - self.scattering**2))

    def as_body(self) -> "Material":
        """Wall material of a scene as a dielectric, which comes nearest to its constant |R|: a thick, slightly lossy
        body with this |R| at normal incidence (0.998 at most); a slab stays as it is.

        `permittivity = ((1 + R) / (1 - R))^2`; elsewhere it follows Fresnel's law.
        """
        if self.level is None:
            return self
        index = (1.0 + self.level) / max(1.0 - self.level, BODY_LEAST)
        return Material(
            permittivity=index**2, conductivity=BODY_LOSS * index, thickness=BODY_THICKNESS, scattering=self.scattering
        )

    @property
    def words(self) -> str:
        """Short text that says what a material is, e.g. `R = 0.85` or `concrete`."""
        if self.reflection is not None:
            return f"R = {self.reflection:g}"
        if self.reflection_te is not None:
            return f"TE {self.reflection_te:g}, TM {self.reflection_tm:g}"
        return self.itu or f"permittivity {self.permittivity:g}, {self.conductivity:g} S/m"


@dataclass(frozen=True, slots=True, eq=False)
class Reflector:
    """A smooth opaque mesh that reflects on both sides. Each plane it has is a wall of its own."""

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
        """Corners (F, 3, 3) [m] of a reflector's triangles: face, corner, xyz."""
        return self.vertices[self.faces]


@dataclass(frozen=True, slots=True, eq=False)
class Occluder:
    """An opaque mesh that hides what lies behind it and reflects nothing."""

    vertices: Floats
    """(V, 3) [m]."""
    faces: Any
    """(F, 3) indices into `vertices`."""
    name: str = ""
    """Name of an occluder that stands alone; empty for one that belongs to a scatterer."""

    def __post_init__(self) -> None:
        _freeze_mesh(self, f"shade '{self.name}'" if self.name else "shade")

    @property
    def triangles(self) -> Floats:
        """Corners (F, 3, 3) [m] of an occluder's triangles: face, corner, xyz."""
        return self.vertices[self.faces]


@dataclass(frozen=True, slots=True, eq=False)
class Scatterer:
    """A point scatterer: a small object that re-radiates in all directions. It hides nothing unless it has a shade."""

    name: str
    position: Floats
    """(3,) [m]."""
    rcs: float
    """Radar cross-section [m^2]; where `law` makes it depend on the carrier or on directions, its nominal value."""
    radius: float | None = None
    """Radius [m] of a sphere or cylinder, if it is one."""
    law: str = "constant"
    """Law of the cross-section: `constant`: `rcs` for all directions; `mie`: a sphere's exact value at the carrier;
    `cylinder`: that of a cylinder by physical optics, for each pair of directions."""
    height: float | None = None
    """Length [m] of a cylinder along its axis."""
    axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector along the axis of a cylinder."""
    shade: Occluder | None = None
    """Occluder of the object's shape; None if it hides nothing. Its own centre it does not hide."""

    def __post_init__(self) -> None:
        freeze(self, np.float64, position=(3,), axis=(3,))
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
    """The true room: reflectors, occluders, scatterers, RIS panels, and the agent's motion. Nothing in `slam/` or
    `design/` may see it."""

    name: str
    reflectors: tuple[Reflector, ...]
    scatterers: tuple[Scatterer, ...]
    ris: RisPanel | RisPanels | None
    """The RIS panel, several of them (`join_panels`), or None."""
    agent: Trajectory
    """True trajectory of the agent."""
    digest: str = ""
    """SHA-256 over the scene file and its meshes; empty for a scene built in memory."""
    occluders: tuple[Occluder, ...] = ()
    """Meshes that hide what lies behind them and are neither wall nor landmark: clutter too small or too round to
    reflect like a plane."""

    def __repr__(self) -> str:
        size = " x ".join(f"{length:.3g}" for length in self.bounds[1] - self.bounds[0])
        each = (
            f"panel of {panel.spec.rows} x {panel.spec.cols} elements at {show_point(panel.center)} m"
            for panel in self.panels
        )
        panels = ", ".join(each) or "no panel"
        counts = f"{len(self.reflectors)} reflectors, {len(self.scatterers)} scatterers, {panels}"
        return f"Scene '{self.name}': {size} m, {counts}, {len(self.agent)} cycles"

    def _repr_html_(self) -> str:
        return html_with(repr(self), self.plan(("true way", self.agent.position)))

    def plan(self, *ways: tuple[str, Floats]) -> PlanView:
        """Plan of a scene seen from above, with named trajectories (K, 3) [m] in it."""
        edges = outline((reflector.vertices, reflector.faces) for reflector in self.reflectors)
        return PlanView(self.bounds, edges, list(zip(self.landmarks, self.landmark_positions, strict=True)), ways)

    @property
    def panels(self) -> tuple[RisPanel, ...]:
        """All RIS panels of a scene, in the order of the code's elements; empty without one."""
        return self.ris.panels if self.ris is not None else ()

    @property
    def landmarks(self) -> tuple[str, ...]:
        """Names of a scene's landmarks in the order of their numbers: scatterers first, then the RIS panels."""
        return tuple(s.name for s in self.scatterers) + tuple(panel.name for panel in self.panels)

    @property
    def landmark_positions(self) -> Floats:
        """Positions (num_landmarks, 3) [m] of a scene's landmarks, in the order of `landmarks`."""
        points = [s.position for s in self.scatterers] + [panel.center for panel in self.panels]
        return np.array(points, dtype=np.float64).reshape(-1, 3)

    def panel_number(self, landmark: int) -> int:
        """Number of the RIS panel that a landmark is, -1 for a scatterer."""
        return max(landmark - len(self.scatterers), -1)

    @property
    def bounds(self) -> Floats:
        """Bounds (2, 3) [m] of a scene: lowest and highest corner of all reflectors."""
        points = np.concatenate([r.vertices for r in self.reflectors]) if self.reflectors else np.zeros((1, 3))
        return np.stack([points.min(axis=0), points.max(axis=0)])


def _freeze_mesh(mesh: Any, place: str) -> None:
    """Check and freeze `vertices` and `faces` of the mesh of a scene's reflector or occluder."""
    freeze(mesh, np.float64, vertices=(None, 3))
    freeze(mesh, np.int64, faces=(None, 3))
    if len(mesh.faces) == 0:
        raise SceneError(f"{place}: the mesh has no faces")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise SceneError(f"{place}: a face names vertex {int(mesh.faces.max())} of {len(mesh.vertices)}")
