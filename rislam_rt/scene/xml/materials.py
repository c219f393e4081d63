"""Radio materials of a Sionna scene file (XML): read as ours, and ours written as them."""

from typing import Any
from xml.etree.ElementTree import Element, SubElement

from rislam_rt.errors import SceneError
from rislam_rt.model import Material
from rislam_rt.model.itu import ITU_MATERIALS
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.xml.shapes import number
from rislam_rt.scene.xml.untrusted_xml import children

DEFAULT_THICKNESS = 0.1
"""Thickness [m] that Sionna takes where a scene file gives none."""
ABSORBER = "absorber-radio-material"
"""Type of a Sionna material that reflects nothing."""
LEFT_OUT = ("xpd_coefficient", "alpha_r", "alpha_i", "lambda_")
"""Properties of a Sionna material that are not carried over: all of diffuse scattering alone."""


def read_material(bsdf: Element) -> tuple[Material | None, list[str]]:
    """Read the radio material of a `<bsdf>` element of a Sionna scene file: `itu-radio-material` and `radio-material`,
    or any whose name says `itu_...`, as Sionna itself takes them; also what could not be carried over.

    None stands for what reflects nothing: an absorber, or air.

    Raises
    ------
    Fault
        It has no radio properties, or they are out of range.
    """
    name = bsdf.get("id") or bsdf.get("name") or ""
    plain, kind = name.removeprefix("mat-"), bsdf.get("type", "")
    values = {e.get("name", ""): e for e in children(bsdf, "float", "integer", "string")}
    notes = [f"bsdf '{one_line(name)[:40]}': {key} is not carried over" for key in LEFT_OUT if key in values]
    own: dict[str, float] = {}
    if kind == "radio-material":
        own["permittivity"] = _number(values, "relative_permittivity", 1.0)
        own["conductivity"] = _number(values, "conductivity", 0.0)
    if kind == ABSORBER or own == {"permittivity": 1.0, "conductivity": 0.0}:  # nothing, or air
        return None, []
    rough = _number(values, "scattering_coefficient", 0.0)
    thickness = _number(values, "thickness", DEFAULT_THICKNESS)
    if kind == "itu-radio-material" or plain.startswith(("itu_", "itu-")):
        given = values["type"].get("value", "") if "type" in values else plain[4:]
        if given not in ITU_MATERIALS:
            raise Fault(f"an ITU material '{one_line(given)[:40]}'", f"take one of {', '.join(ITU_MATERIALS)}")
        return _made(itu=given, thickness=thickness, scattering=rough), notes
    if kind == "radio-material":
        return _made(**own, thickness=thickness, scattering=rough), notes
    mend = "call it itu_concrete (or itu_ and another name of ITU-R P.2040), or make it an itu-radio-material"
    raise Fault(f"a material of type '{one_line(kind)[:40]}' says nothing of radio", mend)


def material_element(material: Material | None, name: str) -> Element:
    """Material in a Sionna scene file (XML), a `<bsdf>`: its own ITU slab, a slab of given permittivity, air for None.

    A constant R has no counterpart that Sionna's `load_scene` knows; what comes nearest is `Material.as_body`. What
    only hides is a slab of air, which Sionna's rays do not pass unless refraction is on: in Sionna RT 2.2.0 no
    frequency can be set where there is an `absorber-radio-material`.
    """
    if material is None:
        return Element("bsdf", {"type": "radio-material", "id": name})
    material = material.as_body()
    bsdf = Element("bsdf", {"type": "itu-radio-material" if material.itu else "radio-material", "id": name})
    values = {"thickness": material.thickness}
    if material.itu:
        SubElement(bsdf, "string", {"name": "type", "value": material.itu})
    else:
        slab = {"relative_permittivity": material.permittivity or 1.0, "conductivity": material.conductivity}
        values = slab | values
    if material.scattering > 0.0:
        values["scattering_coefficient"] = material.scattering
    for key, value in values.items():
        SubElement(bsdf, "float", {"name": key, "value": repr(float(value))})
    return bsdf


def _number(values: dict[str, Element], name: str, default: float) -> float:
    """Number that a material of a Sionna scene file (XML) gives under a name, or else the default."""
    return number(values[name], "value") if name in values else default


def _made(**values: Any) -> Material:
    """Material of an XML scene file from its numbers; an error where they are out of range."""
    try:
        return Material(**values)
    except SceneError as error:
        raise Fault.of(error) from None


def material_word(material: Material | None) -> str:
    """Kind of a material for its name in a written XML scene; Sionna takes names with `itu` its own way."""
    if material is None:
        return "air"
    return material.itu if material.itu else ("constant" if material.level is not None else "slab")
