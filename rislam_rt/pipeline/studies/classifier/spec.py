"""What the pipeline file of a classifier's training may say."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rislam_rt.measurement import ReceiverConfig
from rislam_rt.pipeline.spec import Count, Positive, RadioSection, ReceiverSection, Section
from rislam_rt.pipeline.studies.spec import RoomSection, StudySpec

Share = Annotated[float, Field(ge=0.0, le=100.0)]


def build_receiver(section: ReceiverSection) -> ReceiverConfig:
    """The receiver's settings.

    Raises
    ------
    ConfigError
        A value is out of the range that the record itself checks.
    """
    return ReceiverConfig(**section.model_dump())


class LearnedRoom(RoomSection):
    """One room; `picture` has no meaning here."""

    depth: Annotated[int, Field(ge=0, le=4)] = 2
    use: Literal["train", "test"]


class NetworkSection(Section):
    """The network and its fit."""

    hidden: Annotated[int, Field(ge=1, le=256)] = 12
    """Width of both hidden layers."""
    penalty: Positive = 1e-3
    """Times half the squared weights."""
    iterations: Count = 400
    restarts: Annotated[int, Field(ge=1, le=50)] = 5
    """Random starts; the first is kept, the others tell how much the start matters."""


class ClassifierSpec(StudySpec):
    """Training of the classifier of multipath components on some rooms, and its score on others."""

    kind: Literal["train_classifier"]
    channel: Literal["traced", "image_source"] = "image_source"
    rooms: Annotated[list[LearnedRoom], Field(min_length=2)]
    walks: Annotated[int, Field(ge=2, le=1000)] = 8
    """Random walks through each room as it is."""
    versions: Annotated[int, Field(ge=1, le=1000)] = 16
    """Random walks, each through a random version of the room (other materials, radii and noise)."""
    cycles: Annotated[int, Field(ge=20, le=10_000)] = 120
    stride: Annotated[int, Field(ge=1, le=100)] = 4
    """Every so many cycles the tracks are examples."""
    snr_low_db: Share = 5.0
    """Range of the reference SNR of random versions; rooms as they are have the radio's own."""
    snr_high_db: Share = 30.0
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Of the intervals, by resampling whole walks."""
    radio: RadioSection = RadioSection()
    receiver: ReceiverSection = ReceiverSection()
    network: NetworkSection = NetworkSection()

    @model_validator(mode="after")
    def _some_of_each(self) -> "ClassifierSpec":
        if len({room.scene for room in self.rooms}) < len(self.rooms):
            raise ValueError("rooms: each scene at most once")
        if {room.use for room in self.rooms} != {"train", "test"}:
            raise ValueError("rooms: at least one to train and one to test on")
        if self.snr_high_db < self.snr_low_db:
            raise ValueError("snr_high_db: below snr_low_db")
        return self
