"""Exact channel of rooms made of planar facets: mirror images with visibility tests, in float64."""

from rislam_rt.channel.image_source.channel import ImageSourceChannel

__all__ = ["ImageSourceChannel"]
