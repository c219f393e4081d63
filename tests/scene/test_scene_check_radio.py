"""What the check says of a scene at a radio: materials at the carrier, elements against the wavelength."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import SceneError
from rislam_rt.model import Material, RadioConfig, RisPanel
from rislam_rt.model.itu import ITU_MATERIALS
from rislam_rt.model.slab import normal_reflection
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.check import material_errors

SCENES = Path(__file__).parents[2] / "scenes"


def test_the_page_on_scenes_lists_every_material_with_its_carriers():
    page = (SCENES.parent / "docs" / "scenes.md").read_text(encoding="utf-8")
    for name, rows in ITU_MATERIALS.items():
        assert f"| `{name}` {', '.join(f'{low:g} to {high:g}' for low, high, *_ in rows)} |" in page


def radio(ghz):
    return RadioConfig(carrier=1e9 * ghz)


@pytest.mark.parametrize("ghz", [0.6, 10.0, 60.0, 105.0])
def test_materials_are_held_against_the_carrier(ghz):
    """An error exactly where the channel would refuse the room later, with file and key."""
    scene = load_scene(SCENES / "itu_room")
    wrong = {
        r.name
        for r in scene.reflectors
        if not any(low <= ghz <= high for low, high, *_ in ITU_MATERIALS[r.material.itu])
    }
    found = [f for f in check_scene(SCENES / "itu_room", radio(ghz)) if f.severity == "error"]
    assert {f.field.split("(")[1][:-1] for f in found} == wrong
    for finding in found:
        assert finding.file.endswith("itu_room/scene.toml")
        assert f"at the carrier of {ghz:g} GHz" in finding.line
    if wrong:
        with pytest.raises(SceneError):
            ImageSourceChannel(scene, radio(ghz), 1)
    else:
        ImageSourceChannel(scene, radio(ghz), 1)


def test_without_a_radio_no_carrier_is_presumed():
    assert not [f for f in check_scene(SCENES / "itu_room") if f.severity == "error"]
    assert len(list(material_errors(load_scene(SCENES / "itu_room"), "x", radio(0.6)))) > 0


@pytest.mark.parametrize(
    ("millimetres", "ghz", "faint"), [(6.0, 10.0, True), (6.0, 7.5, False), (8.0, 7.5, True), (3.0, 10.0, False)]
)
def test_a_pane_of_half_a_wave_is_named_once(millimetres: float, ghz: float, faint: bool) -> None:
    """Half a wave in glass (n = 2.51) measures 5.97 mm at 10 GHz, and 7.96 mm at 7.5 GHz."""
    scene = load_scene(SCENES / "itu_room")
    pane = Material(itu="glass", thickness=1e-3 * millimetres)
    walls = tuple(replace(wall, material=pane) for wall in scene.reflectors[:3])
    lines = [f.line for f in check_scene(replace(scene, reflectors=walls), radio(ghz)) if "half waves" in f.message]
    assert len(lines) == faint
    if faint:
        assert f"({walls[0].name} and 2 more): {millimetres:g} mm of 'glass' reflect 0.0" in lines[0]
        assert f"at {ghz:g} GHz and normal incidence, a thick slab 0.43" in lines[0]
        assert "reflection = 0.43" in lines[0]


@pytest.mark.parametrize(("permittivity", "thickness"), [(4.0, 0.05), (6.31, 0.2), (9.0, 0.0123)])
def test_the_figures_of_a_slab_are_those_of_its_faces(permittivity: float, thickness: float) -> None:
    """Of a lossless slab the sum over all echoes between its faces; half a wave as its definition has it."""
    found = normal_reflection(Material(permittivity=permittivity, thickness=thickness), 10e9)
    assert found is not None
    n = np.sqrt(permittivity)
    face = (1.0 - n) / (1.0 + n)
    turn = np.exp(-4j * np.pi * 10e9 / SPEED_OF_LIGHT * n * thickness)
    echoes = face + (1.0 - face**2) * -face * turn * sum((face**2 * turn) ** k for k in range(60))
    assert found.slab == pytest.approx(abs(echoes), abs=1e-12)
    assert found.half_space == pytest.approx(abs(face), abs=1e-15)
    assert found.half_wave == pytest.approx(SPEED_OF_LIGHT / (2.0 * 10e9 * n))


@pytest.mark.parametrize(
    ("spacing", "ghz", "cols", "warned"),
    [
        ([0.031, 0.015], 10.0, 6, True),
        ([0.015, 0.031], 10.0, 6, True),
        ([0.029, 0.029], 10.0, 6, False),
        ([0.029, 0.029], 10.4, 6, True),
        ([0.031, 0.015], 10.0, 1, False),  # one column: nothing is a wavelength apart along the row
    ],
)
def test_elements_a_wavelength_apart_are_ambiguous(spacing, ghz, cols, warned):
    scene = load_scene(SCENES / "paper_room")
    spec = replace(scene.ris.spec, spacing=np.array(spacing), cols=cols, element="energy")
    scene = replace(scene, ris=RisPanel(spec, scene.ris.center, scene.ris.host))
    fields = [f.field for f in check_scene(scene, radio(ghz)) if f.severity == "warning"]
    assert ("ris.spacing_m" in fields) == warned
