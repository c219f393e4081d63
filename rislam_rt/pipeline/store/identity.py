"""Identity of a run: all that its numbers depend on, the hash over it, and the name of the run folder."""

import hashlib
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from rislam_rt.model import Scene
from rislam_rt.pipeline.own_method_files import own_digests
from rislam_rt.pipeline.run import library_versions
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.scene.scene_folder import safe_name
from rislam_rt.storage.checksums import SCHEMA, checksum, flatten

SHORT = 8
"""Number of the hash's digits in a run folder's name; the marker file inside has all of them."""

BACKEND = ("RISLAM_RT_DEVICE", "RISLAM_RT_THREADS")
"""Environment variables that the last digits of traced paths depend on."""

NO_NUMBERS = ("cli", "report")
"""Folders of the package that only show numbers, so that changes there make no new run."""


class RunIdentity(NamedTuple):
    """Identity of a run: settings, scene, code and library versions; runs of equal identity have equal results."""

    content: Mapping[str, Any]
    """`config` (every setting, defaults filled in), `scene` (name, SHA-256 of its files), `versions` of the libraries,
    `own` (SHA-256 of methods of one's own),
    `code` (SHA-256 of this package), `backend` (what the environment says of the tracer), `schema`."""

    @property
    def digest(self) -> str:
        """SHA-256 of the identity, 64 hexadecimal digits."""
        return checksum(self.content)

    @property
    def folder(self) -> str:
        """Name of the run folder: `<pipeline>-<scene>-<seed>-<hash>`."""
        config = self.content["config"]
        name = f"{config['name']}-{safe_name(self.content['scene']['name'])}-{config['seed']}"
        return short_name(name, self.digest)

    def difference(self, other: Mapping[str, Any]) -> str:
        """Describe the first setting in which the identity of another run differs, as `key is A there and B here`."""
        here, there = dict(flatten(self.content)), dict(flatten(other))
        for key in sorted(here):
            if here[key] != there.get(key):
                return f"{key} is {str(there.get(key))[:40]} there and {str(here[key])[:40]} here"
        return "it has settings that this version does not know"


def run_identity(spec: PipelineSpec, scene: Scene) -> RunIdentity:
    """Identity of a SLAM run from its specification and scene; the scene's folder and the description do not count."""
    return RunIdentity(
        {
            "schema": SCHEMA,
            "config": spec.model_dump(mode="json", exclude={"description", "scene"}),
            "scene": {"name": scene.name, "sha256": scene.digest},
            "versions": library_versions(),
            "code": code_digest(),
            "own": own_digests([*spec.schemes, spec.channel]),
            "backend": {name: os.environ.get(name, "") for name in BACKEND},
        }
    )


def short_name(name: str, digest: str) -> str:
    """Name of a run folder: `name` and the first digits of the identity's hash."""
    return f"{name}-{digest[:SHORT]}"


@cache
def code_digest(root: Path = Path(__file__).parents[2]) -> str:
    """SHA-256 over all files of this package but those that only show numbers: part of a run's identity."""
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*")):
        parts = file.relative_to(root).parts
        if file.is_file() and parts[0] not in NO_NUMBERS and "__pycache__" not in parts:
            data = file.read_bytes()
            digest.update(f"{'/'.join(parts)}\0{len(data)}\0".encode())
            digest.update(data)
    return digest.hexdigest()
