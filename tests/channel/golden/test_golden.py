"""Today's channels against the golden files beside this one (written by `build.py`)."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from build import FOLDER, SCENES, golden_paths, read

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.model import RadioConfig
from rislam_rt.scene import load_scene

FILES = sorted(FOLDER.glob("*.nc"))


def test_every_room_has_its_file():
    assert [file.stem for file in FILES] == sorted(path.parent.name for path in SCENES.glob("*/scene.toml"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
@pytest.mark.parametrize("channel", [ImageSourceChannel, TracedChannel])
def test_paths_are_the_golden_ones(channel, file):
    trajectory, depth, want = read(file)
    have = golden_paths(channel(load_scene(SCENES / file.stem), RadioConfig(), depth).paths(trajectory))
    traced = channel is TracedChannel
    np.testing.assert_array_equal(have["cycle"], want["cycle"])
    assert have["label"].tolist() == want["label"].tolist()
    # float64 of two builds of numpy may differ in the last digits; the traced field is float32
    np.testing.assert_allclose(have["tau"], want["tau"], rtol=1e-12)
    for name in ("departure", "arrival"):
        np.testing.assert_allclose(have[name], want[name], atol=1e-9)
    gain, golden = have["gain_re"] + 1j * have["gain_im"], want["gain_re"] + 1j * want["gain_im"]
    np.testing.assert_allclose(gain, golden, rtol=5e-3 if traced else 1e-7, atol=0.0)
