"""Specification of a classifier's training: what its pipeline file may say."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rislam_rt.measurement import ReceiverConfig
from rislam_rt.pipeline.specification.radio import RadioSection
from rislam_rt.pipeline.specification.section import Count, Positive, Section
from rislam_rt.pipeline.specification.spec import ReceiverSection
from rislam_rt.scene.random_rooms import CYCLES
from rislam_rt.studies.spec import ComparedRoomSection, StudySpec

LEARNT_FIRST = 1_000_000
"""Drawn rooms from this number on are learnt from; those below it never are."""

Share = Annotated[float, Field(ge=0.0, le=100.0)]


def build_receiver(section: ReceiverSection) -> ReceiverConfig:
    """The receiver's settings by the specification of a classifier's training.

    Raises
    ------
    ConfigError
        A value is out of the range that the record itself checks.
    """
    return ReceiverConfig(**section.model_dump())


class TestedRoom(ComparedRoomSection):
    """One room, for testing alone; `picture` has no meaning here."""

    depth: Annotated[int, Field(ge=0, le=4)] = 2


class NetworkSection(Section):
    """The network and its fit."""

    hidden: Annotated[int, Field(ge=1, le=256)] = 12
    """Width of both hidden layers."""
    penalty: Positive = 1e-3
    """Times half the squared weights."""
    iterations: Count = 400
    """Most steps of a fit."""
    restarts: Annotated[int, Field(ge=1, le=50)] = 5
    """Random starts; the best on the random rooms for validation is kept."""


class ClassifierSpec(StudySpec):
    """Training of the classifier of multipath components on random rooms, and its score on named ones."""

    kind: Literal["train_classifier"]
    """Which study the file is."""
    channel: Literal["traced", "image_source"] = "image_source"
    """Ray tracer, or exact image sources."""
    train: Annotated[int, Field(ge=2, le=10_000)] = 160
    """Random rooms to learn from, one walk through each."""
    validation: Annotated[int, Field(ge=2, le=10_000)] = 40
    """More random rooms, by which the best of the random starts is chosen."""
    rooms: Annotated[list[TestedRoom], Field(min_length=1)]
    """Rooms to test on, once everything is chosen."""
    walks: Annotated[int, Field(ge=2, le=1000)] = 8
    """Random walks through each of them."""
    cycles: Annotated[int, Field(ge=20, le=CYCLES)] = 120
    """Length of a walk; a drawn room's own motion has no more."""
    drawn_first: Annotated[int, Field(ge=0, lt=LEARNT_FIRST // 2)] = 200
    """First of the drawn rooms (`scene.random_rooms`) to test on, as in the study of unseen rooms."""
    drawn: Annotated[int, Field(ge=2, le=LEARNT_FIRST // 2)] = 40
    """How many of them."""
    stride: Annotated[int, Field(ge=1, le=100)] = 4
    """Every so many cycles the tracks are examples."""
    snr_low_db: Share = 0.0
    """Range of the reference SNR of random rooms; the rooms of the test have the radio's own."""
    snr_high_db: Share = 30.0
    """Its upper end."""
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Of the intervals, by resampling whole walks."""
    radio: RadioSection = RadioSection()
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
