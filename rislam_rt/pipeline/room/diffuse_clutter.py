"""What a run hears beside the paths that have an identity: walls that scatter, edges that diffract."""

from dataclasses import replace

from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.errors import ConfigError
from rislam_rt.measurement import Clutter
from rislam_rt.model import Paths, RadioConfig, Scene, Trajectory
from rislam_rt.pipeline.specification.diffuse import DiffuseSection


def check_diffuse(scene: Scene, section: DiffuseSection, channel: str) -> None:
    """Refuse diffuse paths that nobody could trace.

    Raises
    ------
    ConfigError
        The channel is not the tracer, or no wall scatters.
    """
    if section.wanted and channel != "traced":
        raise ConfigError(f"extras: set, with channel '{channel}', which knows none; give channel = 'traced'")
    if section.diffuse and not any(reflector.material.scattering > 0.0 for reflector in scene.reflectors):
        raise ConfigError("extras.diffuse: no wall scatters; give room.scattering, or a material's 'scattering'")


def trace_diffuse_clutter(
    scene: Scene, radio: RadioConfig, motion: Trajectory, section: DiffuseSection
) -> Paths | None:
    """Scattered and diffracted paths along a motion, by cells of the receiver; None if none are wanted.

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    if not section.wanted:
        return None
    from rislam_rt.channel.traced.diffuse_paths import DiffuseConfig, trace_diffuse_paths
    from rislam_rt.channel.traced.resolution_cells import as_paths

    if not section.diffuse:
        smooth = [replace(r, material=replace(r.material, scattering=0.0)) for r in scene.reflectors]
        scene = replace(scene, reflectors=tuple(smooth))
    config = DiffuseConfig(diffraction=section.diffraction, depth=section.depth, samples=section.samples)
    return as_paths(trace_diffuse_paths(scene, radio, motion, config), motion, radio)


def received_clutter(paths: Paths, motion: Trajectory, radio: RadioConfig) -> Clutter:
    """Diffuse clutter as received, with what it turns by within the slot."""
    return Clutter(paths, doppler_shift(paths, motion, radio.wavelength))
