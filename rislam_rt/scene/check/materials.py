"""Scene check of materials: whether they are specified at the radio's carrier."""

from collections.abc import Iterator

from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.model.itu import ITU_MATERIALS, itu_parameters
from rislam_rt.scene.findings import Finding


def material_errors(scene: Scene, file: str, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: errors of reflectors whose ITU-R P.2040 material is not specified at the carrier."""
    ghz = radio.carrier / 1e9
    for number, reflector in enumerate(scene.reflectors):
        name = reflector.material.itu
        if name is None:
            continue
        try:
            itu_parameters(name, radio.carrier)
        except SceneError:
            ranges = " or ".join(f"{row[0]:g} to {row[1]:g} GHz" for row in ITU_MATERIALS[name])
            message = f"'{name}' is not specified at the carrier of {ghz:g} GHz, only from {ranges}"
            field = f"reflector[{number}].material.itu ({reflector.name})"
            yield Finding("error", file, field, message, "take another material, or radio.carrier_ghz in that range")
