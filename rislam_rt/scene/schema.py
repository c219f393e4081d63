"""Schema of `scene.toml`: keys, types and ranges. Unknown keys are refused; all bad fields are found at once."""

import unicodedata
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from rislam_rt.input_messages import counted

SMALLEST = 1e-6
"""Smallest length [m] or time [s] in a scene file: nothing that a radio sees is finer."""

Coordinate = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=SMALLEST, le=1e5, allow_inf_nan=False)]
Area = Annotated[float, Field(ge=SMALLEST**2, le=1e10, allow_inf_nan=False)]
Vector = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Name = Annotated[
    str,
    Field(pattern=r"^[.\-]*[\p{L}\p{N}_][\p{L}\p{M}\p{N}_.\-]*$", max_length=64),
    AfterValidator(lambda name: unicodedata.normalize("NFC", name)),
]
"""Name in a scene file: letters and digits of any script, composed, so that names which look alike are alike."""
Count = Annotated[int, Field(ge=1, le=1_000_000)]

ItuMaterial = Literal[
    "asphalt_concrete", "brick", "carpet_tile", "ceiling_board", "chipboard", "clear_acrylic", "concrete", "floorboard",
    "glass", "marble", "medium_dry_ground", "metal", "plasterboard", "plywood", "very_dry_ground", "vinyl_tile",
    "wet_ground", "wood",
]  # fmt: skip


Units = Literal["mm", "cm", "m", "in"]


class SceneSection(BaseModel):
    """Base of the scene file's tables: no conversions, no unknown keys."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class MaterialSection(SceneSection):
    """Material of a reflector in the scene file: one of `reflection` (the same at every angle), `reflection_te` with
    `reflection_tm` (one for each polarisation), `itu`, a slab of an ITU-R P.2040 material, and `permittivity`
    (relative, with `conductivity_s_m`), a slab of one's own. `scattering` takes a share from the mirrored ray."""

    reflection: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    itu: ItuMaterial | None = None
    permittivity: Annotated[float, Field(ge=1.0, le=1e6, allow_inf_nan=False)] | None = None
    conductivity_s_m: Annotated[float, Field(ge=0.0, le=1e9, allow_inf_nan=False)] | None = None
    thickness_m: Length | None = None
    reflection_te: Annotated[float, Field(ge=-1.0, le=1.0)] | None = None
    reflection_tm: Annotated[float, Field(ge=-1.0, le=1.0)] | None = None
    scattering: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0

    @model_validator(mode="after")
    def _one_kind(self) -> "MaterialSection":
        if sum(kind is not None for kind in (self.reflection, self.itu, self.permittivity, self.reflection_te)) != 1:
            raise ValueError("give one of 'reflection', 'itu', 'permittivity' and 'reflection_te'")
        polarised = (self.reflection_te, self.reflection_tm)
        if polarised.count(None) == 1 or 0.0 in polarised:
            raise ValueError("give 'reflection_te' and 'reflection_tm' together, neither of them 0")
        if self.itu is None and self.permittivity is None and self.thickness_m is not None:
            raise ValueError("'thickness_m' has a meaning with 'itu' or 'permittivity' only")
        if self.permittivity is None and self.conductivity_s_m is not None:
            raise ValueError("'conductivity_s_m' has a meaning with 'permittivity' only")
        if self.permittivity == 1.0 and not self.conductivity_s_m:
            raise ValueError("a permittivity of 1 without 'conductivity_s_m' is air; give more of either, or no mesh")
        return self


class MeshSection(SceneSection):
    """Placement of one mesh file in the scene file. `up_axis = "y"` turns a file whose y axis points up (as glTF's
    standard says) into the room's frame with z up, `units` and `origin` are those of `[meshes]`, for this mesh
    alone."""

    up_axis: Literal["y", "z"] | None = None
    units: Units | None = None
    origin: Vector | None = None


class ReflectorSection(MeshSection):
    """`[[reflector]]` of the scene file: a smooth mesh. `mesh = "room.glb#node"` takes one named node of a GLB file,
    with its transform applied."""

    name: Name
    mesh: str
    material: MaterialSection


class OccluderSection(MeshSection):
    """`[[shade]]` of the scene file: a mesh that hides what lies behind it and reflects nothing, clutter too small or
    too round to be a mirror."""

    name: Name
    mesh: str


class MeshesSection(SceneSection):
    """`[meshes]` of the scene file: placement of all its mesh files, unless a mesh says otherwise."""

    up: Literal["y", "z"] = "z"
    """Axis of the files that points up."""
    units: Units = "m"
    """Unit of length of the files."""
    origin: Vector = [0.0, 0.0, 0.0]
    """[m] The point, z up, that becomes the room's zero."""


class ScattererSection(MeshSection):
    """`[[scatterer]]` of the scene file, a small object: a sphere by its `radius` (cross-section pi r^2, or by `mie`
    the exact series), a cylinder by `radius` and `height_m`, or a point by its `rcs_m2`.

    It shades nothing, unless `shadow` asks for the shadow of its own shape or `mesh` gives a shape (PLY, OBJ, STL or
    GLB in the room's frame, as a reflector's).
    """

    name: Name
    position: Vector
    radius: Length | None = None
    rcs_m2: Area | None = None
    mie: bool = False
    height_m: Length | None = None
    axis: Vector | None = None
    shadow: bool = False
    mesh: str | None = None

    @model_validator(mode="after")
    def _one_size(self) -> "ScattererSection":
        if self.radius is None and self.rcs_m2 is None:
            raise ValueError("give 'radius' or 'rcs_m2'")
        if self.radius is None and (self.mie or self.height_m is not None or self.shadow):
            raise ValueError("'mie', 'height_m' and 'shadow' need a 'radius'")
        if self.mie and (self.height_m is not None or self.rcs_m2 is not None):
            raise ValueError("'mie' is for spheres whose cross-section is not given")
        if self.axis is not None and (self.height_m is None or not any(self.axis)):
            raise ValueError("'axis' is a cylinder's direction: give it a length, and 'height_m' beside it")
        if self.shadow and self.mesh is not None:
            raise ValueError("give either 'shadow' or 'mesh'")
        return self


class RisSection(SceneSection):
    """`[ris]` of the scene file: a RIS panel. `normal` and `up` need not have length 1."""

    name: Name = "ris"
    center: Vector
    normal: Vector
    up: Vector
    rows: Annotated[int, Field(ge=1, le=1024)]
    cols: Annotated[int, Field(ge=1, le=1024)]
    spacing_m: Annotated[list[Length], Field(min_length=2, max_length=2)]
    levels: Annotated[int, Field(ge=2, le=65536)] = 4
    element: Literal["tang", "energy"] = "tang"
    amplitude: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    host: Name | None = None


class WalkSection(SceneSection):
    """`random_walk` of the scene file's `[agent]`: a random walk through the room, level, from the agent's start."""

    seed: Annotated[int, Field(ge=0, lt=2**63)]
    clearance_m: Length = 0.4
    """Least distance [m] of the walk from every surface."""


class AgentSection(SceneSection):
    """`[agent]` of the scene file, the agent's true motion, one of four: straight from `start` with `velocity`;
    recorded, `trajectory`, a TUM or CSV file; along `waypoints`; or a `random_walk`."""

    start: Vector | None = None
    velocity: Vector | None = None
    trajectory: str | None = None
    columns: dict[str, str] | None = None
    """Names of a CSV file's columns, where not as `recorded_columns.COLUMNS`."""
    waypoints: Annotated[list[Vector], Field(min_length=2, max_length=10_000)] | None = None
    random_walk: WalkSection | None = None
    speed_m_s: Length | None = None
    acceleration_m_s2: Length = 0.5
    """Acceleration at the corners of waypoints or a random walk: their arcs have the radius speed squared over this;
    and from rest to the speed and back, where there is a halt or `from_rest`."""
    halt_s: list[Annotated[float, Field(ge=0.0, le=1e5, allow_inf_nan=False)]] | None = None
    """Halts [s] at the waypoints, one for each, 0 for none."""
    from_rest: bool | None = None
    """Whether waypoints begin and end at rest; as long as `halt_s` is given without it."""
    heading_deg: Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)] | None = None
    """Heading [deg] all along the waypoints; that of the way without it."""
    turn_deg_s: Annotated[float, Field(gt=0.0, le=1e5, allow_inf_nan=False)] | None = None
    """Rate [deg/s] of turns on the spot at halts; without it they take the whole halt."""
    cycles: Count | None = None
    cycle_s: Length | None = None
    tx_offset_m: Vector | None = None
    rx_offset_m: Vector | None = None

    @model_validator(mode="after")
    def _one_motion(self) -> "AgentSection":
        given = [name for name in MOTIONS if getattr(self, name) is not None]
        if len(given) != 1:
            received = f"{' and '.join(map(repr, given))} given; " if given else ""
            raise ValueError(f"{received}give one of {', '.join(map(repr, MOTIONS))}")
        missing = [name for name in MOTIONS[given[0]] if getattr(self, name) is None]
        if missing:
            raise ValueError(f"'{given[0]}' needs {', '.join(map(repr, missing))} beside it")
        if self.waypoints is not None and self.start is not None:
            raise ValueError("the first waypoint is the start; leave 'start' out")
        if self.speed_m_s is not None and given[0] not in ("waypoints", "random_walk"):
            raise ValueError(f"'speed_m_s' means nothing with '{given[0]}'; leave it out")
        self._check_stops(given[0])
        unknown = set(self.columns or ()) - {"time", "x", "y", "z", "heading", "qx", "qy", "qz", "qw"}
        if unknown:
            raise ValueError(f"columns: '{min(unknown)[:20]}' is none of time, x, y, z, heading, qx, qy, qz, qw")
        return self

    def _check_stops(self, motion: str) -> None:
        """Check the agent's keys of halts and headings against its motion and each other."""
        of_waypoints = ("halt_s", "from_rest", "heading_deg", "turn_deg_s")
        keys = [name for name in of_waypoints if getattr(self, name) is not None]
        if keys and self.waypoints is None:
            raise ValueError(f"'{keys[0]}' means nothing with '{motion}'; leave it out, or give 'waypoints' instead")
        if self.halt_s is not None and len(self.halt_s) != len(self.waypoints or ()):
            what = f"'halt_s' has {counted(len(self.halt_s), 'number')} for {len(self.waypoints or ())} waypoints"
            raise ValueError(f"{what}; give one for each, 0 where it does not halt")
        if self.from_rest is False and any((self.halt_s or [])[:: max(1, len(self.halt_s or ()) - 1)]):
            raise ValueError("'halt_s' halts at an end, and 'from_rest = false' moves there; give 0, or leave that out")
        if self.turn_deg_s is not None and self.heading_deg is not None:
            raise ValueError("'turn_deg_s' means nothing with the fixed 'heading_deg'; leave one of the two out")


MOTIONS = {
    "velocity": ("start", "cycles", "cycle_s"),
    "trajectory": (),
    "waypoints": ("speed_m_s", "cycle_s"),
    "random_walk": ("start", "speed_m_s", "cycles", "cycle_s"),
}
"""Keys of the agent's motion in the scene file, one of which is given, and what each needs beside it."""


class LimitsSection(SceneSection):
    """`[limits]` of the scene file: how large a room may be. The defaults keep check and trace within minutes; a file
    that knows better says so."""

    faces: Annotated[int, Field(ge=1, le=20_000_000)] = 50_000
    """Most triangles of all meshes together: check and trace take time in proportion to them, times cycles."""
    nodes: Annotated[int, Field(ge=1, le=1_000_000)] = 1_000
    """Most nodes of a GLB file: reading takes time in proportion to their square."""
    scatterers: Annotated[int, Field(ge=1, le=1_000_000)] = 1_000
    """Most point scatterers: each is traced on its own, with every wall on both legs."""


class SceneSpec(SceneSection):
    """Validated content of a whole scene file."""

    name: Name
    reflector: Annotated[list[ReflectorSection], Field(min_length=1, max_length=10_000)]
    scatterer: list[ScattererSection] = []
    shade: Annotated[list[OccluderSection], Field(max_length=10_000)] = []
    meshes: MeshesSection = MeshesSection()
    ris: Annotated[
        list[RisSection], BeforeValidator(lambda ris: [ris] if isinstance(ris, dict) else ris), Field(max_length=100)
    ] = []
    """`[ris]` for one panel, `[[ris]]` for several."""
    agent: AgentSection
    limits: LimitsSection = LimitsSection()

    @model_validator(mode="after")
    def _not_too_many_and_distinct(self) -> "SceneSpec":
        if len(self.scatterer) > self.limits.scatterers:
            mend = f"take fewer, or raise limits.scatterers = {self.limits.scatterers}"
            raise ValueError(f"{len(self.scatterer)} scatterers, of which each is traced on its own; {mend}")
        names = [panel.name for panel in self.ris]
        if len(set(names)) < len(names):
            raise ValueError(f"ris.name: {', '.join(names)} received; give every panel a name of its own")
        levels = [panel.levels for panel in self.ris]
        if len(set(levels)) > 1:
            raise ValueError(f"ris.levels: {levels} received; give all panels the same number of phase levels")
        return self
