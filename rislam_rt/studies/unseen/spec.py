"""Specification of a study in unseen rooms: what its pipeline file may say."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rislam_rt.pipeline.specification.section import Count, Decibel
from rislam_rt.studies.swept.spec import SweptSpec, VariantSection, check_names

TEST = 10_000
"""Rooms below are for development; those from here on are for tests, and every run of them is counted."""


class UnseenSpec(SweptSpec):
    """An estimator in many random rooms."""

    kind: Literal["unseen"]
    """Which study the file is."""
    repetitions: Literal[1] = 1
    """Each room is run once: other draws are other rooms."""
    first: Annotated[int, Field(ge=0, lt=2**31)] = 0
    """Seed of the first room."""
    rooms: Count = 60
    """How many, with seeds one after the other."""
    snr_db: list[Decibel] = Field(default=[13.0], min_length=1)
    """SNR of the paper's sphere at 3 m, integrated over the signal and all antennas."""
    variants: list[VariantSection] = Field(default=[])
    """Settings under which every room is run; the main job's alone by default."""
    save: Literal["nothing", "components", "signals"] = "nothing"
    """What is left of every run as a data set: nothing but its scores; what the estimator was given and the truth; the
    samples of the received signal as well."""
    ledger: str = "unseen_tests.csv"
    """File beside the pipeline's in which runs of test rooms are counted."""

    @property
    def all_variants(self) -> list[VariantSection]:
        """The variants."""
        return self.variants

    @property
    def is_test(self) -> bool:
        """Whether the unseen rooms are those for tests."""
        return self.first >= TEST

    @model_validator(mode="after")
    def _one_purpose(self) -> "UnseenSpec":
        check_names(self.variants)
        if self.first < TEST < self.first + self.rooms:
            raise ValueError(
                f"rooms: {self.first} to {self.first + self.rooms - 1} lie on both sides of {TEST}; give rooms for "
                f"development (below) or for tests (from {TEST} on)"
            )
        return self
