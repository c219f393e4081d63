"""A DeepMIMO scenario, read with numpy alone: every quantity against the path's own vertices."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.model import Material, RadioConfig
from rislam_rt.report.exports.deepmimo import check_name, deepmimo_files
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def exported():
    scene = load_scene(ROOT / "scenes" / "paper_room")
    scene = replace(scene, agent=scene.agent[:600:300])
    radio = RadioConfig()
    paths = ImageSourceChannel(scene, radio, 2).paths(scene.agent)
    return scene, paths, deepmimo_files(scene, paths, radio, 2)


def read(files, name, cycle):
    content = files[f"scene_{cycle:05d}/{name}_t000_tx000_r001.npz"]
    return np.load(io.BytesIO(content))[name]


@pytest.mark.parametrize("cycle", [0, 1])
def test_each_path_is_as_long_as_its_points_say(exported, cycle):
    _, paths, files = exported
    tx, rx = (read(files, name, cycle)[0] for name in ("tx_pos", "rx_pos"))
    delay, points = read(files, "delay", cycle)[0], read(files, "inter_pos", cycle)[0]
    codes = read(files, "inter", cycle)[0]
    assert len(delay) == paths.valid[cycle].sum()
    for number in range(len(delay)):
        real = points[number][np.isfinite(points[number]).all(axis=1)]
        line = np.stack([tx, *real, rx])
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        assert delay[number] * SPEED_OF_LIGHT == pytest.approx(length, abs=1e-9)
        assert len(real) == (len(str(int(codes[number]))) if codes[number] else 0)
        away, back = line[1] - line[0], line[-2] - line[-1]
        for kind, ray in (("aod", away), ("aoa", back)):
            azimuth, zenith = (np.deg2rad(read(files, f"{kind}_{axis}", cycle)[0, number]) for axis in ("az", "el"))
            found = [np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)]
            np.testing.assert_allclose(found, ray / np.linalg.norm(ray), atol=1e-9)


def test_power_and_phase_are_the_gains_strongest_first(exported):
    _, paths, files = exported
    power, phase = (read(files, name, 1)[0] for name in ("power", "phase"))
    assert (np.diff(power) <= 0.0).all()
    total = np.sum(10.0 ** (power / 20.0) * np.exp(1j * np.deg2rad(phase)))
    assert total == pytest.approx(paths.gain[1, paths.valid[1]].sum(), rel=1e-12)


def test_kinds_are_the_formats_codes(exported):
    _, paths, files = exported
    codes = read(files, "inter", 0)[0].astype(int)
    digits = "".join(sorted({one for code in codes for one in str(code)}))
    assert digits == "013"
    assert np.sum(codes == 0) == 1
    assert np.sum(codes == 3) == 2  # the sphere and the panel
    assert np.sum([set(str(code)) == {"1"} for code in codes]) == np.sum(paths.valid[0] & (paths.kind == 1))


def test_the_room_and_its_description(exported):
    scene, _, files = exported
    about = json.loads(files["params.json"])
    assert about["scene"]["num_scenes"] == 2
    assert about["rt_params"]["frequency"] == 10e9
    np.testing.assert_array_equal(about["rt_params"]["raw_params"]["time_s"], scene.agent.time)
    # the half-space that reflects 0.85 at normal incidence
    index = np.sqrt(about["materials"]["material_0"]["permittivity"])
    assert (index - 1.0) / (index + 1.0) == pytest.approx(0.85)
    pool = np.load(io.BytesIO(files["scene_00000/vertices.npz"]))["vertices"]
    faces = np.load(io.BytesIO(files["scene_00000/faces.npz"]))
    for number, one in enumerate(scene.reflectors):
        np.testing.assert_array_equal(pool[faces[str(number)]], one.triangles)


def test_materials_of_all_sorts(exported):
    scene, paths, _ = exported
    sorts = [Material(reflection=1.0), Material(itu="concrete"), Material(permittivity=4.0, conductivity=0.01)]
    walls = [replace(one, material=sorts[n % 3]) for n, one in enumerate(scene.reflectors)]
    files = deepmimo_files(replace(scene, reflectors=tuple(walls)), paths, RadioConfig(), 2)
    metal, concrete, own = json.loads(files["params.json"])["materials"].values()
    assert metal["conductivity"] == 1e7
    assert concrete["conductivity"] == pytest.approx(0.0462 * 10.0**0.7822)
    assert (own["permittivity"], own["conductivity"]) == (4.0, 0.01)


@pytest.mark.parametrize("name", ["Room", "a:b"])
def test_a_name_that_the_package_cannot_load_is_refused(name):
    with pytest.raises(ConfigError, match="lower case"):
        check_name(name)
