"""Diffuse clutter of a run: paths that rough walls scatter and edges diffract, which no landmark explains."""

from dataclasses import replace

from rislam_rt.errors import ConfigError
from rislam_rt.model import Paths, RadioConfig, Scene, Trajectory
from rislam_rt.pipeline.specification.pipeline_spec import DiffuseSection


def check_diffuse(scene: Scene, section: DiffuseSection, channel: str) -> None:
    """Check that the diffuse paths asked for can be found: the channel is the ray tracer, and some wall scatters.

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
    """Trace scattered and diffracted paths along a trajectory, summed by resolution cell; None if none are wanted.

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    if not section.wanted:
        return None
    from rislam_rt.channel.traced.diffuse_paths import DiffuseConfig, as_paths, trace_diffuse_paths

    if not section.diffuse:
        smooth = [replace(r, material=replace(r.material, scattering=0.0)) for r in scene.reflectors]
        scene = replace(scene, reflectors=tuple(smooth))
    config = DiffuseConfig(diffraction=section.diffraction, depth=section.depth, samples=section.samples)
    return as_paths(trace_diffuse_paths(scene, radio, motion, config), motion, radio)
