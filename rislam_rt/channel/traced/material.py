"""A wall with the same reflection coefficient at every angle, as a radio material of Sionna RT."""

import drjit as dr
import mitsuba as mi
from sionna.rt import InteractionType
from sionna.rt.radio_materials import RadioMaterialBase
from sionna.rt.utils import jones_matrix_from_real_imag, theta_hat, theta_phi_from_unit_vec
from sionna.rt.utils.jones import implicit_basis_vector, jones_matrix_rotator


def kept_components(reflection: mi.Float, incident: mi.Vector3f, reflected: mi.Vector3f) -> mi.Matrix4f:
    """Jones matrix, in Sionna's bases, of a reflection that keeps the field's theta and phi parts and scales both by R.

    Sionna's basis is theta_hat, except within 1e-3 rad of the vertical, where it is a fixed direction in both rays: R
    times the identity there would mirror the field and multiply a matched signal by `-cos(2 phi)`.
    """

    def to_spherical(ray: mi.Vector3f) -> mi.Matrix2f:
        return jones_matrix_rotator(ray, implicit_basis_vector(ray), theta_hat(*theta_phi_from_unit_vec(ray)))

    turned = to_spherical(reflected).T @ to_spherical(incident)
    return jones_matrix_from_real_imag(turned * reflection, mi.Matrix2f(0.0))


class ConstantReflection(RadioMaterialBase):  # type: ignore[misc]
    """Sionna radio material of a wall with coefficient R in (0, 1] at every angle and polarisation; nothing passes or
    scatters.

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
        """Register R of the material with Mitsuba's differentiable parameters."""
        callback.put("reflection", self._reflection, mi.ParamFlags.Differentiable)

    def to_string(self) -> str:
        """Description of a wall's material of constant R in words."""
        return f"ConstantReflection R={self._reflection[0]:.3f}"

    def _jones(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f) -> mi.Matrix4f:
        """Jones matrix of a reflection at a wall of constant R, as a real 4 x 4 matrix in Sionna's bases."""
        return kept_components(self._reflection, si.to_world(si.wi), wo)


mi.register_bsdf("rislam-constant-reflection", lambda props: ConstantReflection(props.id(), 1.0))
