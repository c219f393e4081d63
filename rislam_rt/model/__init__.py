"""Floor 2: frozen dataclasses of scene, radio, paths, measurement, estimate and result, checked once on construction.
No behaviour beyond what a field's name promises."""

from rislam_rt.model.estimate import MapEstimate, PanelCandidate, SlamEstimate, empty_map, pose_estimate
from rislam_rt.model.measurement import Measurement, PathTruth
from rislam_rt.model.paths import PathKind, Paths, RisLegs
from rislam_rt.model.radio import Antennas, RadioConfig, RxArray
from rislam_rt.model.result import NOTHING, STEPS, SchemeResult, SlamResult
from rislam_rt.model.ris import (
    DataSheet,
    RisCode,
    RisPanel,
    RisPanels,
    RisSpec,
    RisSpecs,
    join_codes,
    join_panels,
    join_sheets,
)
from rislam_rt.model.scene import Material, Occluder, Reflector, Scatterer, Scene
from rislam_rt.model.sensor_model import SensorModel, detection_probability, merged_pull
from rislam_rt.model.trajectory import Body, Trajectory

__all__ = [
    "NOTHING", "STEPS", "Antennas", "Body", "DataSheet", "MapEstimate", "Material", "Measurement", "Occluder",
    "PanelCandidate", "PathKind", "PathTruth", "Paths", "RadioConfig", "Reflector", "RisCode", "RisLegs", "RisPanel",
    "RisPanels", "RisSpec", "RisSpecs", "RxArray", "Scatterer", "Scene", "SchemeResult", "SensorModel", "SlamEstimate",
    "SlamResult", "Trajectory", "detection_probability", "empty_map", "join_codes", "join_panels", "join_sheets",
    "merged_pull", "pose_estimate",
]  # fmt: skip
