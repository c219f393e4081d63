"""True sources of multipath components, for the score of data association: a landmark, its mirror image, or walls."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.channel.walls import build_walls
from rislam_rt.model import NOTHING, PathKind, Paths, Scene, SchemeResult
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.own_methods import is_own
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.scores.wall_scores import coplanar
from rislam_rt.pipeline.specification.pipeline_spec import Settings

Source = tuple[int, ...]
"""Source of a path: landmark and the plane that mirrors it (-1: none); of a wall return -1 and its planes, sorted."""


def uses_wall_returns(scheme: str, settings: Settings) -> bool:
    """Whether the score of association counts wall returns (VT paths) as sources: a scheme's estimator uses them."""
    known = scheme in SCHEMES or is_own(scheme)
    return known and ESTIMATORS[SCHEMES[scheme].estimator].use_vt(settings)


def component_labels(scene: Scene, paths: Paths, scheme: SchemeResult, *, use_vt: bool) -> tuple[Integers, Integers]:
    """Associated landmark and true source of each component of a run, as numbers; -1 for none, in order of time.

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
    """Number (W,) of the plane that each wall, as a source of components, lies in; coplanar walls have one."""
    return [int(plane) for plane in coplanar(build_walls(scene))]


def path_sources(paths: Paths, planes: Sequence[int], *, use_vt: bool) -> list[Source | None]:
    """True source of each path (P,) with walls in `planes` (W,); None for LOS, and for wall returns unless `use_vt`."""
    found: list[Source | None] = []
    for kind, landmark, tx, rx in map(paths.identity, range(paths.num_paths)):
        before, after = [planes[wall] for wall in tx], [planes[wall] for wall in rx]
        if kind == PathKind.LOS or (kind == PathKind.VT and not use_vt):
            found.append(None)
        elif kind == PathKind.VT:
            found.append((-1, *sorted(before + after)))
        else:
            found.append((landmark, after[0] if after else before[-1] if before else -1))
    return found
