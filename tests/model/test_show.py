"""What a record says of itself at a prompt and in a notebook, and what a wrong argument is told."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable

import numpy as np
import pytest

import rislam_rt
from rislam_rt.errors import ConfigError
from rislam_rt.model import Scene, SlamResult
from rislam_rt.model.plan_view import outline
from rislam_rt.pipeline import load_spec
from rislam_rt.shipped import find_pipeline

RADIO = rislam_rt.RadioConfig()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return rislam_rt.load_scene("paper_room")


@pytest.fixture(scope="module")
def result(scene: Scene) -> SlamResult:
    spec = load_spec(
        find_pipeline("trace_then_slam"), ["cycles=5", "channel=image_source", "depth=1", "receiver.estimator=bound"]
    )
    return rislam_rt.run_slam(scene, spec, rng=np.random.default_rng(1))


def test_a_line_each(scene: Scene, result: SlamResult) -> None:
    paths = rislam_rt.ImageSourceChannel(scene, RADIO, depth=1).paths(scene.agent[:3])
    scheme = result.schemes["optimized"]
    for record in (scene, scene.agent, paths, result, scheme, scheme.map):
        assert len(repr(record)) < 250
        assert "array(" not in repr(record)
    assert repr(scene) == (
        "Scene 'paper_room': 6 x 6 x 3 m, 6 reflectors, 1 scatterers, "
        "panel of 6 x 6 elements at (3, 3, 3) m, 600 cycles"
    )
    assert "3 cycles" in repr(paths)
    assert "LOS 1, VT 6" in repr(paths)
    assert "seed 1" in repr(result)
    assert repr(scene.agent[:0]) == "Trajectory: no cycles"


def test_the_picture_is_well_formed_and_holds_what_there_is(scene: Scene, result: SlamResult) -> None:
    drawn = ElementTree.fromstring(result._repr_html_()[: -len("</div>")].partition("<br>")[2])
    titles = [title.text for title in drawn.iter("{http://www.w3.org/2000/svg}title")]
    assert titles == ["true way", "optimized", "random", "sphere", "ris"]
    assert "<svg" in scene._repr_html_()


def test_outline_leaves_out_what_only_cuts_a_plane() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert len(outline([(square, np.array([[0, 1, 2], [0, 2, 3]]))])) == 4
    folded = square + np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1.0]])
    assert len(outline([(folded, np.array([[0, 1, 2], [0, 2, 3]]))])) == 5
    box = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([[face for a, b, c, d in quads for face in ([a, b, c], [a, c, d])]]).reshape(-1, 3)
    assert len(outline([(box, faces)])) == 12


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: rislam_rt.ImageSourceChannel(s, 3), "radio: int received; give a RadioConfig"),
        (lambda s: rislam_rt.TracedChannel(s, 3), "radio: int received; give a RadioConfig"),
        (lambda s: rislam_rt.ImageSourceChannel("room", RADIO), "scene: str received; give a Scene"),
        (lambda s: rislam_rt.ImageSourceChannel(s, RADIO, 1.5), "depth: float received; give a int"),
        (lambda s: rislam_rt.ImageSourceChannel(s, RADIO).paths(s), "trajectory: Scene received; give a Trajectory"),
        (lambda s: rislam_rt.compare_paths(s, s, s, s), "traced: Scene received; give a Paths"),
        (lambda s: rislam_rt.run_slam(s, {}, rng=None), "spec: dict received; give a PipelineSpec"),
        (lambda s: rislam_rt.load_scene(3), "path: int received; give a str or Path"),
    ],
)
def test_a_wrong_argument_is_named(scene: Scene, call: Callable[[Scene], object], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        call(scene)
