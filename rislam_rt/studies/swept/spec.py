"""Specification of a swept study: what its pipeline file may say."""

from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rislam_rt.pipeline.specification.section import Decibel, Name, Positive, Section
from rislam_rt.studies.spec import Seed


class VariantSection(Section):
    """Settings of the main job under a name."""

    name: Name
    group: str = ""
    """Heading under which it stands in a table."""
    note: str = ""
    """One line on what it means."""
    set: dict[str, Any] = Field(default={})
    """Values by dotted key, as `slam.use_vt`."""


class SweptSpec(Section):
    """What all swept studies share."""

    kind: str
    """Which study the file is."""
    name: Name
    """Of folders and pages."""
    description: str = ""
    """For readers alone."""
    seed: Seed = 7
    """Of every random draw."""
    repetitions: Annotated[int, Field(ge=1, le=100_000)] = 20
    """Runs with different seeds at every point; a repetition has the same motion and noise at all of them."""
    time_limit_s: Positive | None = None
    """Longest time one cell may take; it counts as failed then."""
    run: dict[str, Any] = Field(default={})
    """Settings of the main job, with its own defaults."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """Variants that the study goes through; none by default."""
        return []

    @model_validator(mode="after")
    def _each_once(self) -> "SweptSpec":
        check_names(self.all_variants)
        return self


class _OneRoom(SweptSpec):
    scene: str | None = None
    """Scene folder, relative to the pipeline file, or a built-in room's name; `--scene` comes first."""


class Fig4bSpec(_OneRoom):
    """Error against SNR, as in Fig. 4(b)."""

    kind: Literal["fig4b"]
    """Which study the file is."""
    snr_db: list[Decibel] = Field(default=[-10.0, 0.0, 10.0, 20.0, 30.0], min_length=1)
    """SNR of the paper's sphere at 3 m, integrated over the signal and all antennas."""
    cases: Annotated[list[VariantSection], Field(min_length=1)]
    """Motions and starts, a part of the figure each."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """The cases."""
        return self.cases


class Fig4cSpec(_OneRoom):
    """Error of agent and panel against the panel's size, as in Fig. 4(c)."""

    kind: Literal["fig4c"]
    """Which study the file is."""
    sizes: list[Annotated[int, Field(ge=1, le=256)]] = Field(default=[4, 6, 8, 10, 12, 16], min_length=1)
    """Elements along one side of a square panel."""


class MismatchSection(Section):
    """One quantity that is not as the belief is told, at several levels."""

    name: Name
    note: str = ""
    """What is wrong."""
    cure: str = ""
    """What would take it away."""
    key: str
    """Dotted key of the main job that the levels set."""
    levels: Annotated[list[float | int | str], Field(min_length=1)]
    ordinary: float | int | str
    """The level that ordinary equipment has; mismatches are ranked by it."""
    source: str = ""
    """Why that is ordinary."""
    unit: str = ""
    set: dict[str, Any] = Field(default={})
    """Further values by dotted key, at every level."""

    @model_validator(mode="after")
    def _ordinary_is_a_level(self) -> "MismatchSection":
        if self.ordinary not in self.levels:
            raise ValueError(f"ordinary: {self.ordinary!r} received; give one of the levels")
        return self

    def variant(self, level: float | int | str) -> "VariantSection":
        """Settings of a mismatch in a study's specification at a level."""
        values = {**self.set, self.key: level}
        return VariantSection(name=f"{self.name}_{level}", group=self.name, note=self.note, set=values)


class RobustnessSpec(_OneRoom):
    """One quantity at a time that is not as the belief is told, all else right."""

    kind: Literal["robustness"]
    """Which study the file is."""
    mismatches: Annotated[list[MismatchSection], Field(min_length=1)]
    """One quantity that the belief is told each, and how wrong it is."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """The reference, in which all is as it is told, and then every level of every mismatch."""
        levels = [mismatch.variant(level) for mismatch in self.mismatches for level in mismatch.levels]
        return [VariantSection(name="reference"), *levels]


class HardwareSpec(_OneRoom):
    """What faults of the front end do to the receiver, one at a time, before and after calibration."""

    kind: Literal["hardware"]
    """Which study the file is."""
    places: Annotated[int, Field(ge=1, le=1000)] = 4
    """Cycles that are looked at, evenly over the last half of the run, panel focused on the agent."""
    calibration_cycles: Annotated[int, Field(ge=2, le=1000)] = 12
    """Of the variants with calibration."""
    faults: Annotated[list[MismatchSection], Field(min_length=1)]
    """One setting of `[hardware]` each, or several at a time."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """An ideal front end, and every level of every fault, as built and calibrated."""
        variants = [VariantSection(name="reference")]
        for fault in self.faults:
            for level in fault.levels:
                one = fault.variant(level)
                more = {**one.set, "hardware.calibration_cycles": self.calibration_cycles}
                variants += [one, VariantSection(name=f"{one.name}{CALIBRATED}", group=one.group, set=more)]
        return variants


CALIBRATED = "_calibrated"
"""End of the name of a variant with calibration."""


class RoomsSpec(SweptSpec):
    """All schemes in many rooms."""

    kind: Literal["rooms"]
    """Which study the file is."""
    scenes: Annotated[list[str], Field(min_length=1)]
    """Scene folders, relative to the pipeline file."""
    variants: list[VariantSection] = Field(default=[])
    """Settings under which every room is run; the main job's alone by default."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """The variants."""
        return self.variants


class AblationsSpec(_OneRoom):
    """One setting changed at a time."""

    kind: Literal["ablations"]
    """Which study the file is."""
    variants: Annotated[list[VariantSection], Field(min_length=1)]
    """The first one is the reference that the others are compared with."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """The variants."""
        return self.variants


SWEPT: dict[str, type[SweptSpec]] = {
    "fig4b": Fig4bSpec,
    "fig4c": Fig4cSpec,
    "rooms": RoomsSpec,
    "ablations": AblationsSpec,
    "robustness": RobustnessSpec,
    "hardware": HardwareSpec,
}
"""Swept studies by the `kind` of their file."""


def check_names(variants: list[VariantSection]) -> None:
    """Refuse a study's specification with variants of one name."""
    twice = [name for name, count in Counter(variant.name for variant in variants).items() if count > 1]
    if twice:
        raise ValueError(f"the name '{twice[0]}' comes twice, of a variant or of a level; give each once")
