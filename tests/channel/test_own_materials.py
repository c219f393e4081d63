"""Materials of one's own: permittivity, conductivity, thickness, scattering; the same in both channels."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt import load_scene
from rislam_rt.channel.compare.channel_comparison import compare_channels
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import SceneError
from rislam_rt.model import Material, RadioConfig, Scene
from rislam_rt.model.itu import itu_parameters
from rislam_rt.scene import check_scene, write_scene
from rislam_rt.scene.scene_folder import scene_file

RADIO = RadioConfig()


def coated(scene: Scene, *materials: Material) -> Scene:
    """A scene whose reflectors take turns with materials."""
    turns = [materials[n % len(materials)] for n in range(len(scene.reflectors))]
    reflectors = tuple(replace(r, material=m) for r, m in zip(scene.reflectors, turns, strict=True))
    return replace(scene, reflectors=reflectors)


def gains(scene: Scene, depth: int = 2) -> np.ndarray:
    """Gains and bounces of the first cycle's paths."""
    paths = ImageSourceChannel(scene, RADIO, depth).paths(scene.agent[:1])
    bounces = (paths.tx_walls >= 0).sum(axis=1) + (paths.rx_walls >= 0).sum(axis=1)
    return paths.gain[0], bounces


@pytest.mark.parametrize("name", ["concrete", "glass", "metal"])
def test_the_numbers_of_an_itu_material_are_that_material(name):
    """P.2040's own formulas for the two numbers, written out here."""
    a, b, c, d = itu_parameters(name, RADIO.carrier)
    room = load_scene("itu_room")
    itu, _ = gains(coated(room, Material(itu=name, thickness=0.07)))
    own, _ = gains(coated(room, Material(permittivity=a * 10.0**b, conductivity=c * 10.0**d, thickness=0.07)))
    np.testing.assert_allclose(own, itu, rtol=1e-12)


def test_each_polarisation_has_its_own_coefficient():
    """Vertical antennas: a wall hit level acts on the field across the plane of incidence, floor and ceiling mostly on
    that in it. Single bounces by hand, from the angle between the vertical and the plane of incidence.
    """
    te, tm, room = -0.8, 0.35, load_scene("empty_box")
    polarised = coated(room, Material(reflection_te=te, reflection_tm=tm))
    paths = ImageSourceChannel(polarised, RADIO, 1).paths(room.agent[:1])
    for p in np.flatnonzero((paths.kind == 1) & paths.valid[0]):
        out, back = paths.departure[0, p], -paths.arrival[0, p]
        normal = (back - out) / np.linalg.norm(back - out)
        across = np.cross(out, normal)
        across /= np.linalg.norm(across)
        vertical = [np.array([0.0, 0.0, 1.0]) - ray[2] * ray for ray in (out, back)]
        before, after = (v / np.linalg.norm(v) for v in vertical)
        by_hand = te * (before @ across) * (after @ across)
        by_hand += tm * (before @ np.cross(across, out)) * (after @ np.cross(across, back))
        length = paths.tau[0, p] * SPEED_OF_LIGHT
        free = RADIO.wavelength / (4.0 * np.pi * length)
        assert abs(paths.gain[0, p]) == pytest.approx(abs(by_hand) * free, rel=1e-9)


def test_polarised_walls_are_written_and_read_back(tmp_path):
    room = coated(load_scene("empty_box"), Material(reflection_te=-0.8, reflection_tm=0.35))
    write_scene(room, tmp_path / "room")
    assert load_scene(tmp_path / "room").reflectors[0].material == room.reflectors[0].material


@pytest.mark.parametrize("smooth", [Material(reflection=0.8), Material(permittivity=4.5, conductivity=0.05)])
def test_every_bounce_on_a_rough_wall_costs_what_it_scatters(smooth):
    room = load_scene("empty_box")
    plain, bounces = gains(coated(room, smooth))
    rough, _ = gains(coated(room, replace(smooth, scattering=0.6)))
    np.testing.assert_allclose(rough, plain * 0.8**bounces, rtol=1e-12)
    assert set(bounces) == {0, 1, 2}


def test_both_channels_agree_on_own_materials():
    room = coated(
        load_scene("itu_room"),
        Material(permittivity=4.5, conductivity=0.05),
        Material(permittivity=2.2, conductivity=0.0, thickness=0.013),
        Material(reflection=0.7, scattering=0.3),
        Material(reflection_te=-0.8, reflection_tm=0.35, scattering=0.1),
        Material(itu="plasterboard", thickness=0.02, scattering=0.2),
    )
    report = compare_channels(room, RADIO, poses=3, depth=2, rng=np.random.default_rng(5), refine=False)
    assert report.passed
    assert report.matched > 300


@pytest.mark.parametrize(
    ("material", "words"),
    [
        ("{ permittivity = 4.5, itu = 'wood' }", "give one of 'reflection', 'itu', 'permittivity' and 'reflection_te'"),
        ("{ reflection = 0.5, conductivity_s_m = 1.0 }", "'conductivity_s_m' has a meaning with 'permittivity' only"),
        ("{ permittivity = 1.0 }", "is air"),
        ("{ reflection_te = 0.5 }", "give 'reflection_te' and 'reflection_tm' together"),
        ("{ reflection_te = 0.5, reflection_tm = 1.5 }", "give at most 1"),
        ("{ permittivity = 0.9 }", "give at least 1"),
        ("{ reflection = 0.5, scattering = 1.0 }", "give less than 1"),
    ],
)
def test_a_bad_material_is_one_line(tmp_path, material, words):
    text = scene_file("empty_box").read_text().replace("{ reflection = 0.85 }", material, 1)
    (tmp_path / "scene.toml").write_text(text)
    (tmp_path / "meshes").symlink_to(scene_file("empty_box").parent / "meshes")
    lines = [finding.line for finding in check_scene(tmp_path)]
    assert len(lines) == 1
    assert words in lines[0]
    assert "reflector[0].material" in lines[0]


@pytest.mark.parametrize(
    "wrong",
    [
        {"permittivity": 0.5},
        {"permittivity": 1.0},
        {"permittivity": 3.0, "conductivity": -1.0},
        {"reflection": 0.5, "conductivity": 1.0},
        {"reflection_te": 0.5},
        {"reflection_te": 0.5, "reflection_tm": 0.0},
        {"reflection": 0.5, "scattering": 1.0},
    ],
)
def test_a_material_in_memory_is_checked_too(wrong):
    with pytest.raises(SceneError, match="material"):
        Material(**wrong)
