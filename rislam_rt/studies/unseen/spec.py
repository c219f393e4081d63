"""Specification of a study in unseen rooms: settings of a pipeline file of kind `unseen`."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rislam_rt.pipeline.specification.section import Count, Decibel
from rislam_rt.scene.random_rooms import Ways
from rislam_rt.studies.swept.spec import SweptSpec, VariantSection

TEST = 10_000
"""Seed of the first test room, every run of which is counted; rooms with smaller seeds are for development."""
WALL_TOP_SPEED = 1.5
"""Top speed [m/s] that receivers are told of agents along walls, who walk at up to 1.4 m/s and climb at up to 0.45."""


class UnseenSpec(SweptSpec):
    """Study of estimators in many random rooms on which they were not developed."""

    kind: Literal["unseen"]
    repetitions: Literal[1] = 1
    """Each room is run once: other draws are other rooms."""
    first: Annotated[int, Field(ge=0, lt=2**31)] = 0
    """Seed of the first room."""
    rooms: Count = 60
    """Number of rooms, with consecutive seeds."""
    ways: Ways = "anyhow"
    """How agents go: in any direction and moving from the first cycle on; or from rest, first parallel or at right
    angles to a wall, at walking speeds and with right angles for corners; or so and carried by a walker, who bobs and
    sways with each step. From rest, receivers are told a `top_speed` of 1.5 m/s unless `run` says another."""
    snr_db: list[Decibel] = Field(default=[13.0], min_length=1)
    """Reference SNRs: of the paper's sphere at 3 m, integrated over the signal and all antennas."""
    variants: list[VariantSection] = Field(default=[])
    """Variants of the SLAM run in every room; `run` alone by default."""
    save: Literal["nothing", "components", "signals"] = "nothing"
    """What is saved of every run beside its scores: nothing; the estimator's inputs and the truth; the samples of the
    received signal as well."""
    ledger: str = "unseen_tests.csv"
    """File beside the pipeline's in which runs of test rooms are counted."""

    @property
    def is_test(self) -> bool:
        """Whether the study in unseen rooms is specified to use the test rooms."""
        return self.first >= TEST

    @property
    def run_settings(self) -> dict[str, Any]:
        """Settings of the runs in unseen rooms that the study specifies; along walls, the receiver's top speed covers
        the agents' unless given."""
        if self.ways == "anyhow":
            return dict(self.run)
        return {**self.run, "receiver": {"top_speed": WALL_TOP_SPEED, **self.run.get("receiver", {})}}

    @model_validator(mode="after")
    def _one_purpose(self) -> "UnseenSpec":
        if self.first < TEST < self.first + self.rooms:
            raise ValueError(
                f"rooms: {self.first} to {self.first + self.rooms - 1} lie on both sides of {TEST}; give rooms for "
                f"development (below) or for tests (from {TEST} on)"
            )
        return self
