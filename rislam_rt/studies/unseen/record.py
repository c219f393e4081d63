"""The record of a study in unseen rooms: what is needed to repeat it."""

from typing import Any

from rislam_rt.pipeline.run import library_versions
from rislam_rt.pipeline.store.identity import code_digest
from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.studies.unseen.spec import UnseenSpec


def unseen_record(spec: UnseenSpec) -> dict[str, Any]:
    """Configuration, the main job's settings with defaults filled in, versions, and the code's hash."""
    return {
        "kind": spec.kind,
        "name": spec.name,
        "versions": library_versions(),
        "code": code_digest(),
        "config": spec.model_dump(mode="json"),
        "settings": cell_spec({"run": spec.run, "variants": {}}).model_dump(mode="json"),
    }
