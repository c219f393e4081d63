"""Channels of a run by name: the ray tracer, image sources, or a user's own; the tracer is loaded on demand."""

from rislam_rt.channel.protocol import Channel
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.pipeline.own_methods import OwnChannel
from rislam_rt.tracer_backend import prepare_backend


def prepare_channel(kind: str) -> None:
    """Load the ray tracer's backend if the channel of that name needs it: a machine that lacks it is found out early.

    Raises
    ------
    SetupError
        The machine lacks something that the tracer needs.
    """
    if kind == "traced":
        prepare_backend()


def build_channel(kind: str, scene: Scene, radio: RadioConfig, depth: int) -> Channel:
    """Build the channel of that name: ray tracer, image sources or a user's own; the tracer is imported on demand."""
    if kind == "traced":
        from rislam_rt.channel.traced import TracedChannel

        return TracedChannel(scene, radio, depth)
    if kind != "image_source":
        return OwnChannel(kind, scene, radio, depth)
    from rislam_rt.channel.image_source import ImageSourceChannel

    return ImageSourceChannel(scene, radio, depth)
