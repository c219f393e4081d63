"""Score of association: what each component truly came from, and what the default filter took it for."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.evaluate import association_score
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.pipeline.run_datasets import SCHEME
from rislam_rt.pipeline.scores.component_sources import (
    component_labels,
    path_sources,
    true_planes,
    uses_wall_returns,
)
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings

PER_CYCLE = [
    name
    for name, (dims, _, _) in SCHEME.items()
    if dims[0] == "time" and not name.startswith("component") and name != "panel"  # of several panels alone
]


@pytest.mark.parametrize("use_vt", [False, True])
def test_reciprocals_are_one_and_wall_returns_count_where_they_are_used(short_result, use_vt):
    paths = short_result.paths
    scheme = short_result.schemes["random"]
    everything = np.arange(paths.num_paths)[None]
    record = replace(
        scheme,
        **{name: getattr(scheme, name)[:1] for name in PER_CYCLE},
        component_path=everything, component_landmark=np.full_like(everything, 5), outcome=("ok",),
        info={name: value[:1] for name, value in scheme.info.items()}, smoothed=None,
    )  # fmt: skip
    label, identity = component_labels(short_result.scene, paths, record, use_vt=use_vt)
    assert (label == 5).all()
    for path, number in enumerate(identity):
        kind, landmark, tx, rx = paths.identity(path)
        if kind == PathKind.LOS or (kind == PathKind.VT and not use_vt):
            assert number == -1
            continue
        if kind == PathKind.VT:
            alike = [
                q for q in range(paths.num_paths) if set(paths.identity(q)[2] + paths.identity(q)[3]) == set(tx + rx)
            ]
            alike = [q for q in alike if paths.kind[q] == kind]
            np.testing.assert_array_equal(np.flatnonzero(identity == number), alike)
            continue
        same = [(kind, landmark, rx[:1], ()), (kind, landmark, (), rx[:1])] if rx else [(kind, landmark, (), tx[-1:])]
        assert all(identity[q] == number for q in range(paths.num_paths) if paths.identity(q) in same)
    of_landmarks = identity[paths.landmark >= 0]
    assert len(np.unique(of_landmarks)) == 2 * (1 + 6) - 1  # with their images; none of the panel in its host


@pytest.mark.parametrize(("scheme", "key"), [("random", "slam.use_vt"), ("bp_slam", "bp_slam.planes")])
def test_who_uses_wall_returns_is_a_setting(scheme, key):
    section, name = key.split(".")
    for use in (False, True):
        settings = build_settings(
            PipelineSpec.model_validate({"name": "own", "scene": "paper_room", section: {name: use}})
        )
        assert uses_wall_returns(scheme, settings) is use


def test_pieces_of_a_wall_are_one_wall(room):
    """What lies in one plane mirrors alike, and no agent can tell it apart."""
    wall = next(r for r in room.reflectors if r.name == "wall_x0")
    pieces = tuple(replace(wall, name=f"piece_{n}", faces=wall.faces[n : n + 1]) for n in range(2))
    split = replace(room, reflectors=(*(r for r in room.reflectors if r is not wall), *pieces))
    found = []
    for scene in (room, split):
        paths = ImageSourceChannel(scene, RadioConfig(), 2).paths(scene.agent[::60])
        sources = path_sources(paths, true_planes(scene), use_vt=True)
        found.append((paths.num_paths, len(set(sources))))
    (whole, of_whole), (cut, of_cut) = found
    assert cut > whole  # each piece has paths of its own
    assert of_cut == of_whole


def test_the_default_filter_tells_walls_apart(run_short):
    """Of what it names, nine in ten are named right, and two-wall returns are named; by its own and the true names."""
    result = run_short("cycles=22", "receiver.estimator=waveform", 'schemes=["no_ris"]')
    label, truth = component_labels(result.scene, result.paths, result.schemes["no_ris"], use_vt=True)
    assert association_score(label, truth).precision > 0.9
    assert (label >= 2**32).any()
