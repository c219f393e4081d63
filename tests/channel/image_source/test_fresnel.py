"""Slab reflection: values and laws from electromagnetics, and their use along a path."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.fresnel import polarisation_basis
from rislam_rt.errors import SceneError
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Material, PathKind, RadioConfig
from rislam_rt.model.itu import ITU_MATERIALS
from rislam_rt.model.slab import relative_permittivity, slab_coefficients

CARRIER = 10e9
materials_at_10_ghz = sorted(n for n, rows in ITU_MATERIALS.items() if any(r[0] <= 10.0 <= r[1] for r in rows))


def slab(cos_theta, permittivity, thickness):
    cos_theta = np.asarray(cos_theta, dtype=float)
    return slab_coefficients(
        cos_theta, np.full(cos_theta.shape, permittivity), np.full(cos_theta.shape, thickness), CARRIER
    )


def test_concrete_at_10_ghz():
    # ITU-R P.2040: conductivity 0.0462 f^0.7822 = 0.27980 S/m; sigma / (2 pi f eps0) = 0.50295
    assert relative_permittivity("concrete", CARRIER) == pytest.approx(5.24 - 0.50295j, abs=1e-4)


@given(st.sampled_from(materials_at_10_ghz), st.floats(0.01, 1.0), st.floats(1e-4, 0.5))
def test_a_passive_slab_reflects_at_most_all(name, cos_theta, thickness):
    te, tm = slab([cos_theta], relative_permittivity(name, CARRIER), thickness)
    assert np.abs(te[0]) <= 1.0 + 1e-9
    assert np.abs(tm[0]) <= 1.0 + 1e-9


def test_laws_of_a_slab():
    cosine = np.linspace(0.05, 1.0, 50)
    te, tm = slab(cosine, 5.24 - 0.5j, 0.2)
    assert te[-1] == pytest.approx(-tm[-1])  # normal incidence: no difference but the basis
    te, tm = slab(cosine, 1.0 + 0.0j, 0.2)
    np.testing.assert_allclose(np.abs([te, tm]), 0.0, atol=1e-12)  # a slab of air
    te, tm = slab(cosine, relative_permittivity("metal", CARRIER), 0.01)
    np.testing.assert_allclose(te, -1.0, atol=1e-3)  # a conductor
    np.testing.assert_allclose(tm[cosine > 0.1], 1.0, atol=5e-3)
    te, tm = slab(cosine, 4.0 + 0.0j, 2.998e8 / CARRIER / 4)
    half_wave = slab([1.0], 4.0 + 0.0j, 299_792_458.0 / CARRIER / 4)  # thickness of half a wavelength inside
    np.testing.assert_allclose(np.abs(half_wave), 0.0, atol=1e-12)


def test_brewsters_angle_of_a_thick_lossy_slab():
    """The TM minimum over angle lies at tan(theta) = sqrt(eps) when nothing comes back from the far face."""
    theta = np.linspace(0.3, 1.5, 4001)
    _, tm = slab(np.cos(theta), 4.0 - 0.05j, 5.0)
    assert theta[np.argmin(np.abs(tm))] == pytest.approx(np.arctan(2.0), abs=2e-3)


def test_a_multilayer_sum_gives_the_same_slab():
    """Second way: the geometric series of all internal reflections, summed term by term."""
    cosine, eps, thickness = np.array([0.3, 0.7, 0.95]), 3.0 - 0.2j, 0.01
    root = np.sqrt(eps - (1 - cosine**2))
    for mode, first in enumerate(((cosine - root) / (cosine + root), (eps * cosine - root) / (eps * cosine + root))):
        lap = np.exp(-4j * np.pi * CARRIER / 299_792_458.0 * thickness * root)
        series = first + (1 - first**2) * sum(-first * lap * (first**2 * lap) ** n for n in range(60))
        np.testing.assert_allclose(slab(cosine, eps, thickness)[mode], series, rtol=1e-12)


def test_polarisation_basis_is_right_handed_and_ignores_the_sense_of_travel():
    rng = np.random.default_rng(0)
    k = unit(rng.standard_normal((50, 3)))
    theta, phi = polarisation_basis(k)
    np.testing.assert_allclose(np.cross(theta, phi), k, atol=1e-12)
    np.testing.assert_allclose(polarisation_basis(-k)[0], theta, atol=1e-12)
    np.testing.assert_allclose(polarisation_basis(np.array([[0.0, 0.0, 1.0]]))[0], [[1.0, 0.0, 0.0]])


def walls_of(paths):
    return [paths.identity(p)[2] for p in range(paths.num_paths)]


def test_single_bounces_see_te_on_walls_and_tm_on_floors(rooms):
    """A vertical dipole's ray in the horizontal plane meets a wall in TE; over floor or ceiling it is TM."""
    radio = RadioConfig()
    scene = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3), material=Material(itu="concrete", thickness=0.2)), [])
    trajectory = rooms.at([2.0, 2.5, 1.5], tx=(-0.5, -0.3, 0.0), rx=(0.5, 0.3, 0.0))
    paths = ImageSourceChannel(scene, radio, 1).paths(trajectory)
    length = paths.tau[0] * 299_792_458.0
    base = radio.wavelength / (4 * np.pi * length) * np.exp(-2j * np.pi / radio.wavelength * length)
    ratio = paths.gain[0] / base
    eps = relative_permittivity("concrete", radio.carrier)
    for p in np.flatnonzero(paths.kind == PathKind.VT):
        name = paths.walls[paths.identity(p)[2][0]]
        axis = {"x": 0, "y": 1}.get(name[5], 2) if name.startswith("wall") else 2
        te, tm = slab([abs(paths.departure[0, p, axis])], eps, 0.2)
        # Vertical fields before and after a floor bounce both have a downward part: TM keeps its sign there
        assert ratio[p] == pytest.approx(te[0] if axis < 2 else tm[0], rel=1e-9)


def test_constant_walls_stay_constant_beside_slabs(rooms):
    """Bounces on constant walls keep the vertical component, so a mixed path has both factors."""
    scene = rooms.paper()
    materials = [Material(itu="glass", thickness=0.01) if r.name == "wall_x0" else r.material for r in scene.reflectors]
    mixed = replace(
        scene, reflectors=tuple(replace(r, material=m) for r, m in zip(scene.reflectors, materials, strict=True))
    )
    trajectory = rooms.at([2.0, 2.5, 1.5])
    plain, glass = (ImageSourceChannel(s, RadioConfig(), 2).paths(trajectory) for s in (scene, mixed))
    x0 = plain.walls.index("wall_x0")
    for p in np.flatnonzero(plain.kind <= PathKind.VT):
        walls = plain.identity(p)[2]
        ratio = glass.gain[0, p] / plain.gain[0, p]
        if x0 not in walls:
            assert ratio == pytest.approx(1.0)
        else:
            assert abs(ratio) < 1.0 / 0.85


@pytest.mark.parametrize(("name", "carrier"), [("mud", 10e9), ("brick", 60e9)])
def test_unknown_materials_are_refused_in_one_line(name, carrier):
    with pytest.raises(SceneError, match=r"material\.itu") as caught:
        relative_permittivity(name, carrier)
    assert "\n" not in str(caught.value)
