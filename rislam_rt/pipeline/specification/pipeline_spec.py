"""Specification of an experiment: all tables of a pipeline file, and their conversion to settings in SI units."""

from dataclasses import fields
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, create_model, model_validator

from rislam_rt.design import DESIGNERS, DesignConfig
from rislam_rt.errors import ConfigError
from rislam_rt.information import GradientMode
from rislam_rt.measurement import HardwareConfig, ReceiverConfig, build_sensor
from rislam_rt.model import RadioConfig, SensorModel
from rislam_rt.pipeline.own_methods import is_own
from rislam_rt.pipeline.schemes import SCHEMES, STORED, check_scheme
from rislam_rt.pipeline.specification.mismatch import AssumedSection
from rislam_rt.pipeline.specification.radio import RadioSection, build_radio, linear
from rislam_rt.pipeline.specification.section import (
    Choices,
    Count,
    Decibel,
    Name,
    NotNegative,
    Positive,
    Probability,
    Section,
    Wide,
)
from rislam_rt.ris import PanelTolerance
from rislam_rt.slam import NestedConfig, SlamConfig
from rislam_rt.slam.schemes.bp_slam import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam_aoa import BpSlamAoaConfig
from rislam_rt.slam.schemes.channel_slam import ChannelSlamConfig


class DiffuseSection(Section):
    """Which diffuse and diffracted paths the ray tracer adds to the received signal, unknown to the agent."""

    diffuse: bool = False
    """Whether rough walls scatter: those whose material has `scattering`, or all by `room.scattering`."""
    diffraction: bool = False
    """Whether edges of walls, objects and openings diffract."""
    depth: Annotated[int, Field(ge=1, le=3)] = 1
    """Largest number of interactions of a diffuse or diffracted path."""
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 2000
    """Rays shot in every cycle; the mean power does not depend on them, its fluctuation does."""

    @property
    def wanted(self) -> bool:
        """Whether the pipeline's specification asks for diffuse or diffracted paths."""
        return self.diffuse or self.diffraction


RECORDS: dict[type, type] = {}
"""Configuration record of each section that was made from one."""


def _table_of(record: type, *, without: tuple[str, ...] = ()) -> Any:
    """Table of a pipeline file made of a record's fields, types and defaults; the record checks its own ranges."""
    kinds: dict[str, Any] = {f.name: (f.type, f.default) for f in fields(record) if f.name not in without}
    section = create_model(f"{record.__name__}Table", __base__=Section, **kinds)
    RECORDS[section] = record
    return section


class SlamSection(_table_of(SlamConfig, without=("nested",))):  # type: ignore[misc]
    """Settings of the SLAM filter, SI units."""


class NestedSection(_table_of(NestedConfig)):  # type: ignore[misc]
    """Settings of the nested particle filter (`slam.filter = "nested"`) beside those of `slam`, SI units."""


class BpSlamSection(_table_of(BpSlamConfig)):  # type: ignore[misc]
    """Settings of the scheme `bp_slam`, SI units."""


class BpSlamAoaSection(_table_of(BpSlamAoaConfig)):  # type: ignore[misc]
    """Settings of the scheme `bp_slam_aoa`, SI units."""


class ChannelSlamSection(_table_of(ChannelSlamConfig)):  # type: ignore[misc]
    """Settings of the scheme `channel_slam`, SI units."""


class ReceiverSection(_table_of(ReceiverConfig, without=("slot", "panels"))):  # type: ignore[misc]
    """Settings of the receiver, SI units; its measurement slot is `budget.measure_s`, its panels are the scene's."""


class HardwareSection(_table_of(HardwareConfig)):  # type: ignore[misc]
    """Impairments of the receiver's front end (with `receiver.estimator = "waveform"`); none by default."""


def _check_channel(name: str, info: ValidationInfo) -> str:
    """Check the setting of a pipeline file that names the channel: a built-in one, or a user's own."""
    if name not in CHANNELS and not is_own(name) and info.context != STORED:
        raise ValueError(f"give one of {', '.join(CHANNELS)}, or module:Class of your own")
    return name


CHANNELS = ("traced", "image_source")
"""Names of the built-in channels."""
SchemeName = Annotated[str, AfterValidator(check_scheme), Choices(SCHEMES)]
ChannelName = Annotated[str, AfterValidator(_check_channel), Choices(CHANNELS)]


class DesignerSection(_table_of(DesignConfig, without=("certify",))):  # type: ignore[misc]
    """Designer of phase codes and its settings."""

    method: Literal[tuple(DESIGNERS)] = "genetic"  # type: ignore[valid-type]
    """Designer of the codes: the paper's genetic algorithm, the exact single-target optimum, coordinate descent, ..."""


class DesignSection(DesignerSection):
    """How the scheme `optimized` designs phase codes from the belief."""

    samples: Annotated[int, Field(ge=1, le=10_000)] = 4
    """Positions drawn from the belief over which the objective is averaged; 1 designs on the mean."""
    landmark_uncertainty: bool = False
    """Whether a landmark's covariance reduces the information of its path."""
    gradient: GradientMode = "exact"
    """Gradient of a path's length with the agent's position in the design; the other three are the paper's."""
    least_snr_db: Decibel | None = None
    """SNR over all antennas at which the receiver detects a path every other time, for a design that weights paths by
    their detection probability; without it every path counts in full, as in the paper."""

    @property
    def least_snr(self) -> float:
        """Least SNR (linear) by the table `[design]` of a pipeline's specification: at it the design takes a path to be
        detected every other time; 0 if not set."""
        return 0.0 if self.least_snr_db is None else linear(self.least_snr_db)


SAME_CYCLE = 0.01
"""Largest relative difference between the scene's cycle time and the sum of the time budget: clocks are inexact."""
DIGITS = 4
"""Significant digits of a proposed step: its rounding is a hundredth of what the sum may differ by."""


class BudgetSection(Section):
    """Time budget [s] of the cycle's four steps; their sum is the scene's cycle time."""

    optimise_s: NotNegative = 0.04
    """Time budget of the code design."""
    communicate_s: NotNegative = 0.01
    """Time budget of sending the code to the panel's controller."""
    measure_s: Positive = 0.01
    """Time budget of sounding the channel."""
    localise_s: NotNegative = 0.04
    """Time budget of localising and mapping."""

    @property
    def total(self) -> float:
        """Sum [s] of the four steps of a pipeline file's time budget."""
        return self.optimise_s + self.communicate_s + self.measure_s + self.localise_s

    def fills(self, cycle: float) -> bool:
        """Whether the steps of the time budget sum to a scene's cycle time [s], but for `SAME_CYCLE` of it."""
        return abs(self.total - cycle) <= SAME_CYCLE * cycle

    def fitted(self, cycle: float, measure_s: float | None = None) -> dict[str, float]:
        """Steps [s], by name, that sum to a scene's cycle time [s]: those of the time budget, scaled alike if they do
        not sum to it. `measure_s` [s], if given, is the measurement's; what is left goes to the localisation."""
        scale = 1.0 if self.fills(cycle) else cycle / (self.total or 1.0)
        steps = {name: float(f"{scale * value:.{DIGITS}g}") for name, value in self.model_dump().items()}
        steps["measure_s"] = steps["measure_s"] if measure_s is None else measure_s
        rest = round(cycle - steps["optimise_s"] - steps["communicate_s"] - steps["measure_s"], 12)
        return steps | {"localise_s": max(float(f"{rest:.{DIGITS}g}"), 0.0)}

    def options(self, steps: dict[str, float]) -> str:
        """Options of the command line that change the time budget to other steps [s]: `--set budget.measure_s=0.004
        ...`."""
        return " ".join(f"--set budget.{name}={s:g}" for name, s in steps.items() if s != getattr(self, name))


class ControlSection(Section):
    """Settings of the control link, whose messages carry phase codes to the panel's controller."""

    levels: Annotated[int, Field(ge=2, le=65536)] | None = None
    """Phase levels that the message can name, a divisor of the panel's; all of them by default."""
    rate_bits_s: Positive = 1e6
    """Bit rate of the link to the controller."""
    loss_probability: Probability = 0.0
    """Probability that a message is lost; the panel then keeps its code and the agent does not know."""
    delay_cycles: Annotated[int, Field(ge=0, le=1000)] = 0
    """Cycles from sending a code to its use, known to the agent."""


class StartSection(Section):
    """Standard deviations of the start prior, whose mean is the true start plus one draw of these errors."""

    position_std_m: Wide = 0.01
    """Standard deviation of each coordinate of the start."""
    velocity_std_m_s: Wide = 0.01
    """Standard deviation of each component of the first velocity."""
    heading_std_deg: NotNegative = 0.0
    """Standard deviation of the first heading, where the heading is estimated."""


class MotionSection(Section):
    """Random accelerations and looks of the true motion beside the scene's trajectory."""

    sigma_a_m_s2: NotNegative = 0.0
    """Standard deviation of the white acceleration in the horizontal plane, drawn anew for every seed (see
    `pipeline.room`); 0 leaves the trajectory as it is. Estimators whose own `sigma_a` is not given assume this one."""
    look_std_deg: NotNegative = 0.0
    """Standard deviation of slow looks to the sides, by which the body's heading departs from the scene's while the way
    stays the same; the compass tells the heading as it is."""


class PanelSection(Section):
    """Hardware errors of the RIS panel, unknown to the agent."""

    amplitude_std: NotNegative = 0.0
    """Standard deviation of an element's amplitude, relative."""
    phase_std_deg: NotNegative = 0.0
    """Standard deviation of an element's phase."""
    dead: Probability = 0.0
    """Probability that an element of the panel reflects nothing."""
    stuck: Probability = 0.0
    """Probability that an element of the panel stays at a random phase level."""
    bit_flip: Probability = 0.0
    """Probability that a bit of a control message arrives flipped."""

    @property
    def tolerance(self) -> PanelTolerance:
        """Hardware tolerances of the RIS panel by the pipeline's specification, phases in radians."""
        return PanelTolerance(self.amplitude_std, float(np.radians(self.phase_std_deg)), self.dead, self.stuck)


class RoomSection(Section):
    """Overrides of the scene: size of the panel, scatterers, wall scattering; none by default."""

    panel_rows: Annotated[int, Field(ge=1, le=256)] | None = None
    """Rows of elements of the panel."""
    panel_cols: Annotated[int, Field(ge=1, le=256)] | None = None
    """Columns of elements of the panel. Spacing of the elements and centre of the panel stay as they are."""
    panel_levels: Annotated[int, Field(ge=2, le=65536)] | None = None
    """Number of phase levels of the panel's elements."""
    scatterers: Annotated[int, Field(ge=0, le=100)] | None = None
    """Number of scatterers: the scene's first ones, and then spheres at places drawn for every seed
    (`pipeline.room`)."""
    scattering: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    """Share of the reflected field that every wall scatters; its specular reflection is weaker for it."""


class PipelineSpec(Section):
    """Specification of a SLAM run: all tables of a pipeline file of kind `slam`."""

    kind: Literal["slam"] = "slam"
    """Kind of the pipeline file: a SLAM run."""
    name: Name
    """Name of the pipeline, in run folders and on pages."""
    description: str = ""
    """Text for readers alone."""
    scene: str | None = None
    """Scene folder, relative to the pipeline file, or a built-in room's name; `--scene` comes first."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 7
    """Seed of every random draw; the same seed gives the same result."""
    cycles: Count | None = None
    """Only the first so many cycles of the scene's trajectory; all of them by default."""
    channel: ChannelName = "traced"
    """Channel model: ray tracer, exact image sources, or `module:Class` of one's own."""
    depth: Annotated[int, Field(ge=0, le=4)] = 2
    """Largest number of wall bounces on a path, both legs together."""
    schemes: list[SchemeName] = Field(default=["optimized", "random"], min_length=1)
    """Schemes compared under the same motion, channel and noise: each has a designer of the panel's codes and an
    estimator. Also `module:function`, a designer or an estimator of one's own."""
    radio: RadioSection = RadioSection()
    receiver: ReceiverSection = ReceiverSection()
    hardware: HardwareSection = HardwareSection()
    design: DesignSection = DesignSection()
    budget: BudgetSection = BudgetSection()
    control: ControlSection = ControlSection()
    room: RoomSection = RoomSection()
    extras: DiffuseSection = DiffuseSection()
    panel: PanelSection = PanelSection()
    motion: MotionSection = MotionSection()
    start: StartSection = StartSection()
    told: AssumedSection = AssumedSection()
    slam: SlamSection = SlamSection()
    nested: NestedSection = NestedSection()
    bp_slam: BpSlamSection = BpSlamSection()
    bp_slam_aoa: BpSlamAoaSection = BpSlamAoaSection()
    channel_slam: ChannelSlamSection = ChannelSlamSection()

    @model_validator(mode="before")
    @classmethod
    def _tell_all_estimators(cls, content: Any) -> Any:
        """Copy a pipeline's process noise, `height`, `use_vt` to every estimator for which the file gives none.

        The motion's acceleration goes to the filter, and the filter's to the others. What is not a table is left for
        the validation to refuse.
        """
        tables = [content, *(content.get(name, {}) for name in ("motion", "slam"))] if isinstance(content, dict) else []
        if not tables or not all(isinstance(table, dict) for table in tables):
            return content
        _, motion, slam = tables
        slam = {"sigma_a": motion.get("sigma_a_m_s2") or SlamSection.model_fields["sigma_a"].default, **slam}
        shared = {key: slam.get(key, SlamSection.model_fields[key].default) for key in ("sigma_a", "height", "use_vt")}
        found = {**content, "slam": slam}
        for name, keys in ESTIMATOR_SECTIONS.items():
            section = content.get(name, {})
            found[name] = {key: shared[key] for key in keys} | section if isinstance(section, dict) else section
        return found

    @model_validator(mode="after")
    def _each_scheme_once(self) -> "PipelineSpec":
        if len(set(self.schemes)) < len(self.schemes):
            raise ValueError("schemes: each at most once; leave the repeated one out")
        return self

    @model_validator(mode="after")
    def _antennas_assumed(self) -> "PipelineSpec":
        if not self.radio.antennas.plain and not self.told.antennas:
            raise ValueError(
                "radio.tx_pattern, rx_pattern, *_polarization: others than isotropic and vertical ones received, which "
                "no estimator can be told of; give told.antennas = 'iso' to have them reckon with isotropic ones"
            )
        if not self.radio.antennas.plain and self.extras.wanted:
            raise ValueError("extras: traced between isotropic, vertical antennas alone; leave out [extras] or those")
        return self


ESTIMATOR_SECTIONS = {
    "bp_slam": ("sigma_a", "height"),
    "bp_slam_aoa": ("sigma_a", "use_vt"),
    "channel_slam": ("sigma_a", "height"),
}
"""Tables of the other published estimators, and the settings that they take over from `[slam]` unless given."""


class Settings(NamedTuple):
    """Settings of a run in SI units: configuration of radio, receiver, sensor model, estimators and code design."""

    radio: RadioConfig
    receiver: ReceiverConfig
    slam: SlamConfig
    design: DesignConfig
    bp_slam: BpSlamConfig
    bp_slam_aoa: BpSlamAoaConfig
    channel_slam: ChannelSlamConfig
    sensor: SensorModel
    """Sensor model of the receiver, for the estimators."""
    hardware: HardwareConfig
    """Impairments of the receiver's front end."""


def build_receiver(section: ReceiverSection, panels: int = 1, **more: float) -> ReceiverConfig:
    """Receiver configuration from the table `[receiver]` of a pipeline's specification, for a room with that number of
    RIS panels; `more` is what the table does not hold.

    Where there is no panel there is nothing to alternate: one capture a cycle, whatever the table says.

    Raises
    ------
    ConfigError
        A value is out of range.
    """
    values = section.model_dump() | more
    values["alternation"] = values["alternation"] and panels > 0
    return ReceiverConfig(**values | {"panels": max(panels, 1)})


def build_settings(spec: PipelineSpec, panels: int = 1) -> Settings:
    """Convert a pipeline's specification to settings in SI units, for a room with that number of RIS panels; 0 for a
    scheme that uses none.

    Raises
    ------
    ConfigError
        A value is out of range, or the front end has impairments and the receiver simulates no signal.
    """
    radio, receiver = build_radio(spec.radio), build_receiver(spec.receiver, panels, slot=spec.budget.measure_s)
    hardware = HardwareConfig(**spec.hardware.model_dump())
    if receiver.estimator != "waveform" and hardware != HardwareConfig():
        raise ConfigError(
            f"hardware: set, with receiver.estimator '{receiver.estimator}', which has no front end; give 'waveform'"
        )
    return Settings(
        radio, receiver, SlamConfig(**spec.slam.model_dump(), nested=NestedConfig(**spec.nested.model_dump())),
        build_design(spec.design), BpSlamConfig(**spec.bp_slam.model_dump()),
        BpSlamAoaConfig(**spec.bp_slam_aoa.model_dump()), ChannelSlamConfig(**spec.channel_slam.model_dump()),
        build_sensor(radio, receiver), hardware,
    )  # fmt: skip


def build_design(section: DesignerSection) -> DesignConfig:
    """Configuration of the phase code designer from the table `[design]` of a pipeline's specification; without the
    certificate of optimality, which takes longer than a cycle.

    Raises
    ------
    ConfigError
        A value is out of range.
    """
    return DesignConfig(**section.model_dump(include={field.name for field in fields(DesignConfig)}), certify=False)
