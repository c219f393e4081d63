"""rislam_rt: ray-traced propagation and SLAM with a reconfigurable intelligent surface.

Names are loaded when first used, so that `import rislam_rt` and the command line's help stay instant.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "rislam_rt.scene": ("load_scene", "check_scene", "new_scene", "write_scene"),
    "rislam_rt.model": (
        "Scene", "Scatterer", "Trajectory", "Body", "RisPanel", "RisSpec", "RisCode", "RadioConfig", "Paths",
        "Measurement", "SensorModel", "SlamEstimate", "MapEstimate", "pose_estimate", "SchemeResult", "SlamResult",
    ),
    "rislam_rt.channel.traced": ("TracedChannel",),
    "rislam_rt.channel.image_source": ("ImageSourceChannel",),
    "rislam_rt.channel.compare": ("compare_paths",),
    "rislam_rt.ris": ("rephase",),
    "rislam_rt.design": ("design_code", "DesignConfig", "Design"),
    "rislam_rt.measurement": ("measure", "ReceiverConfig", "build_sensor"),
    "rislam_rt.slam": ("SlamConfig", "StartPrior"),
    "rislam_rt.pipeline": ("load_spec", "run_slam", "build_radio"),
    "rislam_rt.pipeline.recordings": (
        "Inputs", "dataset_to_inputs", "localise", "read_inputs", "inputs_of", "replay", "answers_from_arrays",
    ),
    "rislam_rt.studies.unseen": ("Recording", "Truth", "read_recording", "record_run", "score_run", "write_recording"),
    "rislam_rt.sweeps": ("Axis", "Sweep", "SweepOptions", "run_sweep"),
}  # fmt: skip
_PUBLIC = {name: home for home, names in _HOMES.items() for name in names}
"""Module of each public name of the package; docs/reference/api.md lists the same names and says what it promises of
them."""

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'rislam_rt' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
