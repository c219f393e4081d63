"""Comparison of both channels in many rooms, path by path, and one pose of one room to look at."""

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
    """One pose of a room: both path sets, the tracer's own float32 numbers, and what sets them apart."""

    scene: Scene
    """Its agent stands at the pose."""
    pose: int
    """Which of the random poses."""
    traced: Paths
    analytic: Paths
    report: PathReport


class Comparison(NamedTuple):
    """A study of both channels: all rooms, and the certificate of the room that is to be shown."""

    rows: list[Validation]
    certificate: Certificate | None

    @property
    def unexplained(self) -> int:
        """One-sided paths without a proof, over all compared rooms."""
        return sum(row.report.unexplained for row in self.rows)

    @property
    def breaches(self) -> int:
        """Errors beyond their limits, over all compared rooms and both kinds of numbers."""
        return sum(row.report.num_breaches for row in self.rows)

    @property
    def passed(self) -> bool:
        """Whether every room's comparison passed."""
        return all(row.report.passed for row in self.rows)


def run_comparison(
    scenes: Sequence[Scene], spec: CompareSpec, *, jobs: int = 1, progress: Tell = tell_nobody
) -> Comparison:
    """Compare both channels in the rooms of a specification, given in its order; `jobs` rooms at a time.

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
    """Compare both channels in one room: the tracer's own numbers, and the refined ones."""
    return validate_rooms([rooms[name]], radio, poses=poses, seed=seed)


def certify_pose(scene: Scene, depth: int, radio: RadioConfig, *, poses: int, seed: int) -> Certificate:
    """The pose with the most one-sided paths among those of the comparison, the first one if there are none."""
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
    """Comparison of every room as plain data, each one-sided path with its proof."""
    return [
        {
            "scene": row.scene,
            "depth": row.depth,
            "numbers": row.numbers,
            **row.report.as_dict(),
            "one_sided": [path._asdict() for path in row.report.one_sided],
        }
        for row in comparison.rows
    ]
