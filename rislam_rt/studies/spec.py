"""Specification of a study: settings of the pipeline files of kinds `compare_channels`, `fig4a` and `claims`."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rislam_rt.model import Scene
from rislam_rt.pipeline.run import library_versions
from rislam_rt.pipeline.specification.pipeline_spec import DesignerSection
from rislam_rt.pipeline.specification.radio import RadioSection
from rislam_rt.pipeline.specification.section import Count, Name, Positive, Section

Depth = Annotated[int, Field(ge=0, le=4)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]


class ComparedRoomSection(Section):
    """One room in which both channels are compared."""

    scene: str
    """Scene folder, relative to the pipeline file, or a built-in room's name."""
    depth: Depth = 3
    """Largest number of wall bounces on a path, both legs together."""
    picture: bool = False
    """Whether the picture of the paths at one pose is of this room."""


class NamedSpec(Section):
    """Settings that the files of all studies share."""

    kind: str
    """Kind of the pipeline file."""
    name: Name
    """Name of the study, in folders and on pages."""
    description: str = ""
    """Text for readers alone."""


class StudySpec(NamedSpec):
    """Settings that all studies share which compute something."""

    seed: Seed = 7
    """Seed of every random draw."""


class RadioStudySpec(StudySpec):
    """Settings that all studies share which have one radio throughout."""

    radio: RadioSection = RadioSection()


class CompareSpec(RadioStudySpec):
    """Comparison of the ray tracer's paths with exact image sources at random poses in many rooms."""

    kind: Literal["compare_channels"]
    poses: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Number of random poses in each room."""
    rooms: Annotated[list[ComparedRoomSection], Field(min_length=1)]
    """Rooms in which both channels are compared: `scene`, `depth`, `picture`."""

    @model_validator(mode="after")
    def _each_room_once(self) -> "CompareSpec":
        if len({room.scene for room in self.rooms}) < len(self.rooms):
            raise ValueError("rooms: each scene at most once")
        if sum(room.picture for room in self.rooms) > 1:
            raise ValueError("rooms: 'picture' for one of them at most")
        return self


class Fig4aSpec(RadioStudySpec):
    """Study of the gain of the direct path over the panel against distance, as in Fig. 4(a) of the paper."""

    kind: Literal["fig4a"]
    scene: str | None = None
    """Scene folder, relative to the pipeline file, or a built-in room's name; `--scene` comes first."""
    channel: Literal["traced", "image_source"] = "traced"
    """Channel model: ray tracer, or exact image sources."""
    elements: list[Literal["tang", "energy"]] = Field(default=["tang", "energy"], min_length=1)
    """Element patterns, one after the other, whatever the scene's panel has."""
    places: Annotated[int, Field(ge=2, le=10_000)] = 25
    """Number of places on the straight line from the trajectory's start to the panel, at the start's height."""
    closest_m: Positive = 0.2
    """Horizontal distance from the panel at the last place."""
    sphere_radius_m: Positive | None = None
    """Radius of the sphere in the panel's place; half the panel's longer side by default."""
    seeds: Count = 10
    """Number of runs of the code designer at each place."""
    draws: Count = 1000
    """Number of random codes at each place."""
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    """Level of the intervals over seeds and over draws."""
    design: DesignerSection = DesignerSection()

    @model_validator(mode="after")
    def _each_element_once(self) -> "Fig4aSpec":
        if len(set(self.elements)) < len(self.elements):
            raise ValueError("elements: each at most once")
        return self


class ClaimsSpec(NamedSpec):
    """Check of the paper's claims against the results of other studies."""

    kind: Literal["claims"]
    results: str = "../docs/results"
    """Folder of `fig4a.json`, `fig4b.json` and `fig4c.json`, relative to the pipeline file."""


def distinct_scenes(scenes: Sequence[Scene]) -> list[Scene]:
    """Scenes of a study under different names: a copy that has the name of an earlier one is called `hall (2)`."""
    taken: set[str] = set()
    found = []
    for scene in scenes:
        names = (scene.name, *(f"{scene.name} ({number})" for number in range(2, len(scenes) + 2)))
        name = next(name for name in names if name not in taken)
        taken.add(name)
        found.append(scene if name == scene.name else replace(scene, name=name))
    return found


def study_record(spec: Any, scenes: list[Scene], **more: Any) -> dict[str, Any]:
    """Record for JSON of what is needed to repeat a study: configuration, seed, versions, hashes of scenes, `more`."""
    hashes = {scene.name: {"sha256": scene.digest} for scene in distinct_scenes(scenes)}
    return {
        "kind": spec.kind, "name": spec.name, "seed": spec.seed, "scenes": hashes, "versions": library_versions(),
        "config": spec.model_dump(mode="json"), **more,
    }  # fmt: skip
