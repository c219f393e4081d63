"""Specification of the classifier's training: settings of a pipeline file of kind `train_classifier`."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rislam_rt.pipeline.specification.pipeline_spec import ReceiverSection
from rislam_rt.pipeline.specification.section import Count, Positive, Section
from rislam_rt.scene.random_rooms import CYCLES
from rislam_rt.studies.spec import ComparedRoomSection, RadioStudySpec

LEARNT_FIRST = 1_000_000
"""Number of the first drawn room that may be in the training set; those below it never are."""

Share = Annotated[float, Field(ge=0.0, le=100.0)]


class TestedRoom(ComparedRoomSection):
    """One named room to test the classifier in; `picture` has no meaning here."""

    depth: Annotated[int, Field(ge=0, le=4)] = 2


class NetworkSection(Section):
    """Size of the classifier's network, and settings of its training."""

    hidden: Annotated[int, Field(ge=1, le=256)] = 12
    """Width of both hidden layers."""
    penalty: Positive = 1e-3
    """Weight decay: factor of half the sum of squared weights in the loss."""
    iterations: Count = 400
    """Largest number of L-BFGS iterations."""
    restarts: Annotated[int, Field(ge=1, le=50)] = 5
    """Number of random starts; the best on the validation rooms is kept."""


class ClassifierSpec(RadioStudySpec):
    """Training of the classifier of multipath components on random rooms, and its score on named ones."""

    kind: Literal["train_classifier"]
    channel: Literal["traced", "image_source"] = "image_source"
    """Channel model: ray tracer, or exact image sources."""
    train: Annotated[int, Field(ge=2, le=10_000)] = 160
    """Number of random rooms in the training set, one walk through each."""
    validation: Annotated[int, Field(ge=2, le=10_000)] = 40
    """Number of further random rooms, by which the best of the random starts is chosen."""
    rooms: Annotated[list[TestedRoom], Field(min_length=1)]
    """Named rooms to test on, once everything is chosen."""
    walks: Annotated[int, Field(ge=2, le=1000)] = 8
    """Number of random walks through each named room."""
    cycles: Annotated[int, Field(ge=20, le=CYCLES)] = 120
    """Cycles of a walk; a drawn room's own motion has no more."""
    drawn_first: Annotated[int, Field(ge=0, lt=LEARNT_FIRST // 2)] = 200
    """First of the drawn rooms (`scene.random_rooms`) to test on, as in the study of unseen rooms."""
    drawn: Annotated[int, Field(ge=2, le=LEARNT_FIRST // 2)] = 40
    """Number of drawn rooms to test on."""
    stride: Annotated[int, Field(ge=1, le=100)] = 4
    """Cycles from one example of a track to the next."""
    snr_low_db: Share = 0.0
    """Lower end of the range of reference SNRs in random rooms; test rooms have the radio's own."""
    snr_high_db: Share = 30.0
    """Upper end of the range of reference SNRs in random rooms."""
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Confidence level of the intervals, by resampling whole walks."""
    receiver: ReceiverSection = ReceiverSection()
    network: NetworkSection = NetworkSection()

    @model_validator(mode="after")
    def _in_order(self) -> "ClassifierSpec":
        if len({room.scene for room in self.rooms}) < len(self.rooms):
            raise ValueError("rooms: each scene at most once")
        if self.snr_high_db < self.snr_low_db:
            raise ValueError("snr_high_db: below snr_low_db")
        if not self.radio.antennas.plain:
            raise ValueError("radio: the classifier reckons with isotropic, vertical antennas; leave out the others")
        return self
