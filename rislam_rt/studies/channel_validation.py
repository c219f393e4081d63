"""Comparison of the ray tracer with the image-source channel in many rooms, path by path, and a pose for a picture."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from rislam_rt.channel.compare import PathReport, Validation, compare_paths, validate_rooms
from rislam_rt.channel.compare.channel_comparison import room_rng, trace_both
from rislam_rt.errors import RislamError
from rislam_rt.model import Paths, RadioConfig, Scene
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.studies.spec import CompareSpec
from rislam_rt.worker_pool import run_side_by_side


class Certificate(NamedTuple):
    """Paths of both channels at one pose of a room, and the report of their differences, for a picture."""

    scene: Scene
    """Scene whose agent is at the pose."""
    pose: int
    """Number of the pose among the random ones."""
    traced: Paths
    """Paths of the ray tracer in its own float32 numbers."""
    analytic: Paths
    """Paths of the image-source channel."""
    report: PathReport


class Comparison(NamedTuple):
    """Result of comparing both channels in many rooms."""

    rows: list[Validation]
    """By room, for raw and refined numbers of the tracer."""
    certificate: Certificate | None
    """Of the room that has a picture."""

    @property
    def unexplained(self) -> int:
        """Number of paths that one channel alone has and nothing explains, over all rooms of the validation."""
        return sum(row.report.unexplained for row in self.rows)

    @property
    def breaches(self) -> int:
        """Number of path errors beyond their limits, over all rooms of the channel validation."""
        return sum(row.report.num_breaches for row in self.rows)

    @property
    def passed(self) -> bool:
        """Whether the channels agree in every room of the validation."""
        return all(row.report.passed for row in self.rows)


def run_comparison(
    scenes: Sequence[Scene], spec: CompareSpec, *, jobs: int = 1, progress: Tell = tell_nobody
) -> Comparison:
    """Compare the ray tracer with the image-source channel in all rooms of a specification, `jobs` rooms at a time.

    `scenes` are the rooms in the specification's order.

    Raises
    ------
    SceneError
        A room is too full for random poses.
    TraceError, SetupError
        The tracer failed, or the machine lacks what it needs.
    """
    radio = build_radio(spec.radio)
    work = {
        str(number): (scene, room.depth) for number, (scene, room) in enumerate(zip(scenes, spec.rooms, strict=True))
    }
    shown = [number for number, room in enumerate(spec.rooms) if room.picture]
    found: dict[str, list[Validation]] = {}
    steps = len(work) + len(shown)
    progress("rooms", 0, steps)
    common = (work, radio, spec.poses, spec.seed)
    for name, rows in run_side_by_side(compare_room, list(work), common, jobs, tell_nobody):
        if isinstance(rows, RislamError):
            raise rows
        found[name] = rows
        progress("rooms", len(found), steps)
    certificate = None
    for number in shown:
        certificate = certify_pose(scenes[number], spec.rooms[number].depth, radio, poses=spec.poses, seed=spec.seed)
        progress("rooms", steps, steps)
    return Comparison([row for name in work for row in found[name]], certificate)


def compare_room(
    name: str, rooms: Mapping[str, tuple[Scene, int]], radio: RadioConfig, poses: int, seed: int, tell: Tell
) -> list[Validation]:
    """Compare both channels in one room of the validation, with the tracer's float32 numbers and refined ones."""
    return validate_rooms([rooms[name]], radio, poses=poses, seed=seed)


def certify_pose(scene: Scene, depth: int, radio: RadioConfig, *, poses: int, seed: int) -> Certificate:
    """For the picture of the channel validation: compare both channels at the pose where most paths are found by one
    alone, or else the first."""
    traced, analytic, motion = trace_both(
        scene, radio, poses=poses, depth=depth, rng=room_rng(scene, seed), refine=False
    )
    whole = compare_paths(traced, analytic, scene, motion, radio=radio)
    count = Counter(path.cycle for path in whole.one_sided)
    pose = min(count, key=lambda cycle: (-count[cycle], cycle), default=0)
    here = motion[pose : pose + 1]
    one_traced, one_analytic = (paths.of_cycle(pose) for paths in (traced, analytic))
    report = compare_paths(one_traced, one_analytic, scene, here, radio=radio)
    return Certificate(replace(scene, agent=here), pose, one_traced, one_analytic, report)


def comparison_table(comparison: Comparison) -> list[dict[str, Any]]:
    """Comparison of both channels in every room as plain data for JSON, one-sided paths with their explanations."""
    return [
        {
            "scene": row.scene, "depth": row.depth, "numbers": row.numbers, **row.report.as_dict(),
            "one_sided": [path._asdict() for path in row.report.one_sided],
        }
        for row in comparison.rows
    ]  # fmt: skip
