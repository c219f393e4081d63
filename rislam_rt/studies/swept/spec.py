"""Specifications of swept studies: settings of the pipeline files of kinds `fig4b`, `fig4c`, `rooms` and others."""

from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rislam_rt.pipeline.specification.section import Decibel, Name, Positive, Section
from rislam_rt.studies.spec import StudySpec


class VariantSection(Section):
    """Named variant of the SLAM run in a study: the settings that it changes."""

    name: Name
    group: str = ""
    """Heading under which the variant is listed in a table."""
    note: str = ""
    """One line on what the variant means."""
    set: dict[str, Any] = Field(default={})
    """Values by dotted key, as `slam.use_vt`."""


class SweptSpec(StudySpec):
    """Settings that all swept studies share."""

    repetitions: Annotated[int, Field(ge=1, le=100_000)] = 20
    """Number of runs with different seeds at every point; a repetition has the same motion and noise at all points."""
    time_limit_s: Positive | None = None
    """Longest time one cell may take; beyond it the cell counts as failed."""
    run: dict[str, Any] = Field(default={})
    """Settings of the SLAM run, those of a pipeline file of kind `slam`."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """Variants of the SLAM run that a swept study specifies: its `variants`, if it has any."""
        return list(getattr(self, "variants", ()))

    @model_validator(mode="after")
    def _each_once(self) -> "SweptSpec":
        names = Counter(variant.name for variant in self.all_variants)
        if twice := [name for name, count in names.items() if count > 1]:
            raise ValueError(f"the name '{twice[0]}' comes twice, of a variant or of a level; give each once")
        return self


class _OneRoom(SweptSpec):
    """Settings of swept studies in a single room."""

    scene: str | None = None
    """Scene folder, relative to the pipeline file, or a built-in room's name; `--scene` comes first."""


class Fig4bSpec(_OneRoom):
    """Study of the position RMSE against SNR for all schemes, as in Fig. 4(b) of the paper."""

    kind: Literal["fig4b"]
    snr_db: list[Decibel] = Field(default=[-10.0, 0.0, 10.0, 20.0, 30.0], min_length=1)
    """Reference SNRs: of the paper's sphere at 3 m, integrated over the signal and all antennas."""
    cases: Annotated[list[VariantSection], Field(min_length=1)]
    """Variants of motion and start, each a part of the figure."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """Variants of motion and start that the study of Fig. 4(b) specifies."""
        return self.cases


class Fig4cSpec(_OneRoom):
    """Study of the RMSE of agent and panel against the panel's size, as in Fig. 4(c) of the paper."""

    kind: Literal["fig4c"]
    sizes: list[Annotated[int, Field(ge=1, le=256)]] = Field(default=[4, 6, 8, 10, 12, 16], min_length=1)
    """Numbers of elements along one side of a square panel."""


class MismatchSection(Section):
    """One quantity of the assumed model or of the hardware that is wrong, at several levels."""

    name: Name
    note: str = ""
    """Description of the mismatch."""
    cure: str = ""
    """What would remove the mismatch."""
    key: str
    """Dotted key of the SLAM run's setting that the levels are values of."""
    levels: Annotated[list[float | int | str], Field(min_length=1)]
    """Values of the mismatch."""
    ordinary: float | int | str
    """Level of ordinary equipment, by which mismatches are ranked."""
    source: str = ""
    """Reason or reference for the ordinary level."""
    unit: str = ""
    """Unit of the levels."""
    set: dict[str, Any] = Field(default={})
    """Further values by dotted key, at every level."""

    @model_validator(mode="after")
    def _ordinary_is_a_level(self) -> "MismatchSection":
        if self.ordinary not in self.levels:
            raise ValueError(f"ordinary: {self.ordinary!r} received; give one of the levels")
        return self

    def variant(self, level: float | int | str) -> "VariantSection":
        """Variant of the SLAM run that the robustness study specifies for this mismatch at a level."""
        values = {**self.set, self.key: level}
        return VariantSection(name=f"{self.name}_{level}", group=self.name, note=self.note, set=values)


class RobustnessSpec(_OneRoom):
    """Study of model mismatch: the RMSE with one quantity of the assumed model wrong at a time."""

    kind: Literal["robustness"]
    mismatches: Annotated[list[MismatchSection], Field(min_length=1)]
    """Quantities of the assumed model, and how wrong each is."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """Variants that the robustness study specifies: the reference without mismatch, and then every level of every
        mismatch."""
        levels = [mismatch.variant(level) for mismatch in self.mismatches for level in mismatch.levels]
        return [VariantSection(name="reference"), *levels]


class HardwareSpec(_OneRoom):
    """Study of the front end's impairments: errors of the receiver with one at a time, with and without calibration."""

    kind: Literal["hardware"]
    places: Annotated[int, Field(ge=1, le=1000)] = 4
    """Number of cycles evaluated, evenly over the last half of the run, panel focused on the agent."""
    calibration_cycles: Annotated[int, Field(ge=2, le=1000)] = 12
    """Cycles of calibration, in the variants that have one."""
    faults: Annotated[list[MismatchSection], Field(min_length=1)]
    """Impairments: one setting of `[hardware]` each, or several at a time."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """Variants that the hardware study specifies: an ideal front end, and every level of every impairment, without
        and with calibration."""
        variants = [VariantSection(name="reference")]
        for fault in self.faults:
            for level in fault.levels:
                one = fault.variant(level)
                more = {**one.set, "hardware.calibration_cycles": self.calibration_cycles}
                variants += [one, VariantSection(name=f"{one.name}{CALIBRATED}", group=one.group, set=more)]
        return variants


CALIBRATED = "_calibrated"
"""Suffix of the name of a variant with calibration."""


class RoomsSpec(SweptSpec):
    """Study of all schemes in many rooms."""

    kind: Literal["rooms"]
    scenes: Annotated[list[str], Field(min_length=1)]
    """Scene folders, relative to the pipeline file."""
    variants: list[VariantSection] = Field(default=[])
    """Variants of the SLAM run in every room; `run` alone by default."""


class AblationsSpec(_OneRoom):
    """Ablation study: the RMSE with one setting of the SLAM run changed at a time."""

    kind: Literal["ablations"]
    variants: Annotated[list[VariantSection], Field(min_length=1)]
    """Variants of the SLAM run; the first is the reference that the others are compared with."""


SWEPT: dict[str, type[SweptSpec]] = {
    "fig4b": Fig4bSpec,
    "fig4c": Fig4cSpec,
    "rooms": RoomsSpec,
    "ablations": AblationsSpec,
    "robustness": RobustnessSpec,
    "hardware": HardwareSpec,
}
"""Specifications of the swept studies by the `kind` of their pipeline file."""
