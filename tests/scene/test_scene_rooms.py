"""The scene file becomes the scene it describes."""

from pathlib import Path

import numpy as np

from rislam_rt.scene import load_scene

SCENES = Path(__file__).parents[2] / "scenes"


def test_paper_room_is_the_papers() -> None:
    scene = load_scene(SCENES / "paper_room")
    assert scene.bounds.tolist() == [[0.0, 0.0, 0.0], [6.0, 6.0, 3.0]]
    assert scene.landmarks == ("sphere", "ris")
    assert {r.material.reflection for r in scene.reflectors} == {0.85}
    assert len(scene.agent) == 600
    # 0.1 m baseline, turned 0.5 rad against the heading; the file's offsets have five decimals.
    baseline = scene.agent.rx[0] - scene.agent.tx[0]
    assert np.isclose(np.linalg.norm(baseline), 0.1, atol=1e-5)
    assert np.isclose(np.arctan2(baseline[1], baseline[0]), np.pi / 4 + 0.5, atol=1e-4)
    assert np.allclose(scene.agent.position[-1], [0.5 + 59.9 * 0.0707, 0.7 + 59.9 * 0.0707, 0.5])
