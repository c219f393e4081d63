"""rislam_rt: ray-traced propagation and SLAM with a reconfigurable intelligent surface.

Names are loaded when first used, so that `import rislam_rt` and the command line's help stay instant.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "load_scene": "rislam_rt.scene",
    "RadioConfig": "rislam_rt.model",
    "Trajectory": "rislam_rt.model",
    "RisCode": "rislam_rt.model",
    "TracedChannel": "rislam_rt.channel.traced",
    "ImageSourceChannel": "rislam_rt.channel.image_source",
    "compare_paths": "rislam_rt.channel.compare",
    "design_code": "rislam_rt.design",
    "run_slam": "rislam_rt.pipeline",
    "localise": "rislam_rt.pipeline.own",
    "read_inputs": "rislam_rt.pipeline.own",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'rislam_rt' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
