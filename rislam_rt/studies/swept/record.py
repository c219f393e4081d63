"""The record of a swept study: what is needed to repeat it."""

from pathlib import Path
from typing import Any

from rislam_rt.scene import load_scene
from rislam_rt.studies.spec import study_record
from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.studies.swept.spec import SweptSpec
from rislam_rt.sweeps import Sweep


def swept_record(spec: SweptSpec, sweep: Sweep, pipeline: Path) -> dict[str, Any]:
    """Configuration, the main job's settings with defaults filled in, seed, versions, and the hash of every scene."""
    named = next((axis.values for axis in sweep.axes if axis.key == "scene"), [sweep.base.get("scene")])
    scenes = [load_scene(pipeline.parent / str(name)) for name in named]
    return study_record(spec, scenes, settings=cell_spec({"run": spec.run, "variants": {}}).model_dump(mode="json"))
