"""Where each component truly came from, for the score of association: a landmark, an image of it, or walls."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.channel.walls import build_walls
from rislam_rt.model import NOTHING, PathKind, Paths, Scene, SchemeResult
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.own_methods import is_own
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.scores.walls import coplanar
from rislam_rt.pipeline.specification.spec import Settings

Source = tuple[int, ...]
"""Landmark and, of its images, the plane next to it (-1: the landmark itself); of a wall return -1 and its planes."""


def uses_wall_returns(scheme: str, settings: Settings) -> bool:
    """Whether a scheme's estimator has wall returns among the measurements of its map."""
    known = scheme in SCHEMES or is_own(scheme)
    return known and ESTIMATORS[SCHEMES[scheme].estimator].use_vt(settings)


def component_labels(scene: Scene, paths: Paths, scheme: SchemeResult, *, use_vt: bool) -> tuple[Integers, Integers]:
    """What the agent took each component for, and what it truly came from; -1 for none, in time order.

    As in the map, a path with walls belongs to the image in the wall next to the landmark, on the Rx leg if it has one.
    A wall return belongs to its walls in any order; to nothing, for an estimator that throws such returns away. Walls
    in one plane mirror alike: they are one, as in the score of walls.
    """
    shown = scheme.component_path != NOTHING
    label = np.maximum(scheme.component_landmark[shown], -1)
    numbers: dict[Source, int] = {}
    identity = np.full(paths.num_paths + 1, -1)
    for path, source in enumerate(path_sources(paths, true_planes(scene), use_vt=use_vt)):
        if source is not None:
            identity[path] = numbers.setdefault(source, len(numbers))
    return label, identity[scheme.component_path[shown]]


def true_planes(scene: Scene) -> list[int]:
    """(W,) the plane of each wall of a room."""
    return [int(plane) for plane in coplanar(build_walls(scene))]


def path_sources(paths: Paths, planes: Sequence[int], *, use_vt: bool) -> list[Source | None]:
    """(P,) what each path comes from, of walls in `planes` (W,); None for LOS, and for wall returns unless they are
    used."""
    return [_source(*paths.identity(path), planes, use_vt) for path in range(paths.num_paths)]


def _source(
    kind: int, landmark: int, tx: tuple[int, ...], rx: tuple[int, ...], planes: Sequence[int], use_vt: bool
) -> Source | None:
    if kind == PathKind.LOS:
        return None
    before, after = [planes[wall] for wall in tx], [planes[wall] for wall in rx]
    if kind == PathKind.VT:
        return (-1, *sorted(before + after)) if use_vt else None
    return landmark, after[0] if after else before[-1] if before else -1
