"""Scattering walls whose edges also diffract: radio materials of Sionna RT for them, and of slabs of given
permittivity."""

from typing import Any

import mitsuba as mi
import sionna.rt as rt

from rislam_rt.channel.traced.material import kept_components
from rislam_rt.errors import SceneError
from rislam_rt.model import Material


class RoughConstantReflection(rt.RadioMaterial):  # type: ignore[misc]
    """Sionna radio material of a wall of constant R with scattering and diffraction.

    Specular and diffuse reflection share R as `sqrt(1 - S^2)` and `S`. Edges diffract like those of a lossy half-space
    that reflects R at normal incidence: the theory of diffraction asks for Fresnel coefficients.
    """

    def __init__(self, name: str, reflection: float, scattering: float) -> None:
        super().__init__(name, **_slab(Material(reflection).as_body(), scattering))
        self._reflection = reflection

    def _event_probabilities(self, r_te: Any, r_tm: Any, t_te: Any, t_tm: Any, enabled_interactions: Any) -> Any:
        """Event probabilities of a scattering wall of constant R, which lets nothing pass; the rest is Sionna's."""
        r, t = mi.Complex2f(self._reflection), mi.Complex2f(0.0)  # type: ignore[operator]
        return super()._event_probabilities(r, r, t, t, enabled_interactions)

    def _specular_reflection_transmission_matrix(self, to_world: Any, ki_local: Any, ko_local: Any, *_: Any) -> Any:
        """Jones matrix of a wall of constant R between the bases of the incident and the reflected ray, as
        `ConstantReflection` has it."""
        return kept_components(mi.Float(self._reflection), to_world @ ki_local, to_world @ ko_local)


class PolarisedReflection(rt.RadioMaterial):  # type: ignore[misc]
    """Sionna radio material of a wall with one constant coefficient across the plane of incidence (TE), another in it
    (TM).

    Edges diffract like those of a body whose |R| at normal incidence is the mean of both.
    """

    def __init__(self, name: str, material: Material, scattering: float) -> None:
        super().__init__(name, **_slab(material.as_body(), scattering))
        self._te, self._tm = material.reflection_te, material.reflection_tm

    def _event_probabilities(self, r_te: Any, r_tm: Any, t_te: Any, t_tm: Any, enabled_interactions: Any) -> Any:
        """Event probabilities of a wall with constant TE and TM coefficients, which lets nothing pass; the rest is
        Sionna's."""
        te, tm, none = (mi.Complex2f(value) for value in (self._te, self._tm, 0.0))  # type: ignore[operator]
        return super()._event_probabilities(te, tm, none, none, enabled_interactions)

    def _specular_reflection_transmission_matrix(
        self, to_world: Any, ki_local: Any, ko_local: Any, reflection: Any, *_: Any
    ) -> Any:
        """Sionna's own Jones matrix, with the constant TE and TM coefficients in place of Fresnel's."""
        te, tm, none = (mi.Complex2f(value) for value in (self._te, self._tm, 0.0))  # type: ignore[operator]
        return super()._specular_reflection_transmission_matrix(
            to_world, ki_local, ko_local, reflection, te, tm, none, none
        )


def slab_material(name: str, material: Material, scattering: float) -> rt.RadioMaterial:
    """Sionna radio material of a slab of given thickness, permittivity and conductivity."""
    return rt.RadioMaterial(name, **_slab(material, scattering))


def _slab(material: Material, scattering: float) -> dict[str, Any]:
    """Keyword arguments of Sionna's `RadioMaterial` for a slab."""
    return {
        "thickness": material.thickness, "relative_permittivity": material.permittivity,
        "conductivity": material.conductivity, "scattering_coefficient": scattering,
    }  # fmt: skip


def rough_material(material: Material, number: int, scattering: float) -> rt.RadioMaterialBase:
    """Sionna radio material of a wall with scattering coefficient S in [0, 1]; the material's own S goes before it."""
    scattering = material.scattering or scattering
    if material.reflection is not None:
        return RoughConstantReflection(f"rough-{number}", material.reflection, scattering)
    if material.reflection_te is not None:
        return PolarisedReflection(f"rough-{number}", material, scattering)
    if material.permittivity is not None:
        return slab_material(f"slab-{number}", material, scattering)
    try:
        return rt.ITURadioMaterial(f"itu-{number}", material.itu, material.thickness, scattering_coefficient=scattering)
    except ValueError as error:
        raise SceneError(f"material.itu: '{material.itu}' received; {error}") from None
