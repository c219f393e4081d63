"""What the check says of a scene at a radio: materials at the carrier, elements against the wavelength."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig, RisPanel
from rislam_rt.model.itu import ITU_MATERIALS
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.check import material_errors

SCENES = Path(__file__).parents[2] / "scenes"


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
