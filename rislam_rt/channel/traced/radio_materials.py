"""Radio materials of Sionna RT for walls: constant R, constant TE and TM, slabs; specular ones, and rough ones."""

from typing import Any

import drjit as dr
import mitsuba as mi
import sionna.rt as rt
from sionna.rt import InteractionType
from sionna.rt.radio_materials import RadioMaterialBase
from sionna.rt.utils import jones_matrix_from_real_imag, theta_hat, theta_phi_from_unit_vec
from sionna.rt.utils.jones import implicit_basis_vector, jones_matrix_rotator

from rislam_rt.errors import SceneError
from rislam_rt.model import Material


def kept_components(reflection: mi.Float, incident: mi.Vector3f, reflected: mi.Vector3f) -> mi.Matrix4f:
    """Jones matrix, in Sionna's bases, of a radio material that keeps the field's theta and phi parts and scales both
    by R.

    Sionna's basis is theta_hat, except within 1e-3 rad of the vertical, where it is a fixed direction in both rays: R
    times the identity there would mirror the field and multiply a matched signal by `-cos(2 phi)`.
    """

    def to_spherical(ray: mi.Vector3f) -> mi.Matrix2f:
        return jones_matrix_rotator(ray, implicit_basis_vector(ray), theta_hat(*theta_phi_from_unit_vec(ray)))

    turned = to_spherical(reflected).T @ to_spherical(incident)
    return jones_matrix_from_real_imag(turned * reflection, mi.Matrix2f(0.0))


class ConstantReflection(RadioMaterialBase):  # type: ignore[misc]
    """Sionna radio material of a wall of one R in (0, 1] for all angles and polarisations; nothing passes or scatters.

    The Jones matrix is R times the identity between the (theta, phi) bases of the incident and the reflected ray: a
    bounce keeps the vertical and the horizontal part of the field and scales both.
    Any other choice would turn part of a matched signal into the other polarisation, and |R| would depend on the angle.
    """

    def __init__(self, name: str, reflection: float) -> None:
        props = mi.Properties("rislam-constant-reflection")
        props.set_id(name)
        super().__init__(props)
        self._reflection = mi.Float(reflection)

    def sample(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, sample1: mi.Float, sample2: mi.Point2f,
        active: bool | mi.Bool = True,
    ) -> tuple[mi.BSDFSample3f, mi.Spectrum]:  # fmt: skip
        """Reflected ray at a material of constant R: always the specular direction."""
        count = dr.width(si.wi)
        result = mi.BSDFSample3f()
        result.sampled_component = dr.full(mi.UInt32, InteractionType.SPECULAR, count)
        result.wo = si.to_world(mi.reflect(-si.wi))
        result.pdf = dr.full(mi.Float, 1.0, count)  # type: ignore[assignment]
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.DeltaReflection)  # type: ignore[assignment]
        result.eta = 1.0  # type: ignore[assignment]
        return result, mi.Spectrum(self._jones(si, result.wo))

    def eval(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool | mi.Bool = True
    ) -> mi.Spectrum:
        """Jones matrix of a wall of constant R as a real 4 x 4 matrix; zero for anything but specular reflection."""
        event = dr.reinterpret_array(mi.UInt, si.dp_du.z)
        return mi.Spectrum(dr.select(event == InteractionType.SPECULAR, self._jones(si, wo), mi.Matrix4f(0.0)))

    def pdf(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool | mi.Bool = True
    ) -> mi.Float:
        """Probability of a specular reflection at a material of constant R: 1."""
        return dr.full(mi.Float, 1.0, dr.width(si.wi))

    def traverse(self, callback: mi.TraversalCallback) -> None:
        """Register the constant R of a radio material with Mitsuba's differentiable parameters."""
        callback.put("reflection", self._reflection, mi.ParamFlags.Differentiable)

    def _jones(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f) -> mi.Matrix4f:
        """Jones matrix of a reflection at a wall of constant R, as a real 4 x 4 matrix in Sionna's bases."""
        return kept_components(self._reflection, si.to_world(si.wi), wo)


mi.register_bsdf("rislam-constant-reflection", lambda props: ConstantReflection(props.id(), 1.0))


class RoughConstantReflection(rt.RadioMaterial):  # type: ignore[misc]
    """Sionna radio material of a wall of constant R with scattering and diffraction.

    Specular and diffuse reflection share R as `sqrt(1 - S^2)` and `S`. Edges diffract like those of a lossy half-space
    that reflects R at normal incidence: the theory of diffraction asks for Fresnel coefficients.
    """

    def __init__(self, name: str, reflection: float, scattering: float) -> None:
        super().__init__(name, **_slab(Material(reflection).as_body(), scattering))
        self._reflection = reflection

    def _event_probabilities(self, r_te: Any, r_tm: Any, t_te: Any, t_tm: Any, enabled_interactions: Any) -> Any:
        """Event probabilities of a rough radio material of constant R, which lets nothing pass."""
        r, t = mi.Complex2f(self._reflection), mi.Complex2f(0.0)  # type: ignore[operator]
        return super()._event_probabilities(r, r, t, t, enabled_interactions)

    def _specular_reflection_transmission_matrix(self, to_world: Any, ki_local: Any, ko_local: Any, *_: Any) -> Any:
        """Jones matrix of a wall of constant R, as `ConstantReflection` has it."""
        return kept_components(mi.Float(self._reflection), to_world @ ki_local, to_world @ ko_local)


class PolarisedReflection(rt.RadioMaterial):  # type: ignore[misc]
    """Sionna radio material of a wall with a constant coefficient across the plane of incidence, another in it.

    Edges diffract like those of a body whose |R| at normal incidence is the mean of both.
    """

    def __init__(self, name: str, material: Material, scattering: float) -> None:
        super().__init__(name, **_slab(material.as_body(), scattering))
        self._te, self._tm = material.reflection_te, material.reflection_tm

    def _event_probabilities(self, r_te: Any, r_tm: Any, t_te: Any, t_tm: Any, enabled_interactions: Any) -> Any:
        """Event probabilities of a wall with constant TE and TM coefficients, which lets nothing pass."""
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


def _slab(material: Material, scattering: float) -> dict[str, Any]:
    """Keyword arguments of Sionna's `RadioMaterial` for a slab."""
    return {
        "thickness": material.thickness, "relative_permittivity": material.permittivity,
        "conductivity": material.conductivity, "scattering_coefficient": scattering,
    }  # fmt: skip


def specular_material(material: Material, number: int) -> rt.RadioMaterialBase:
    """Sionna radio material of a specular wall: constant R, constant TE and TM, or a slab by permittivity or ITU."""
    if material.reflection is not None:
        return ConstantReflection(f"constant-{number}", material.reflection * material.specular_share)
    return _layered_material(material, number, material.scattering)


def rough_material(material: Material, number: int, scattering: float) -> rt.RadioMaterialBase:
    """Sionna radio material of a wall with scattering coefficient S in [0, 1]; the material's own S goes before it."""
    scattering = material.scattering or scattering
    if material.reflection is not None:
        return RoughConstantReflection(f"rough-{number}", material.reflection, scattering)
    return _layered_material(material, number, scattering)


def _layered_material(material: Material, number: int, scattering: float) -> rt.RadioMaterialBase:
    """Sionna radio material of a wall that has no constant R: constant TE and TM, or a slab by permittivity or ITU."""
    if material.reflection_te is not None:
        return PolarisedReflection(f"polarised-{number}", material, scattering)
    if material.permittivity is not None:
        return rt.RadioMaterial(f"slab-{number}", **_slab(material, scattering))
    try:
        return rt.ITURadioMaterial(f"itu-{number}", material.itu, material.thickness, scattering_coefficient=scattering)
    except ValueError as error:
        raise SceneError(f"material.itu: '{material.itu}' received; {error}") from None
