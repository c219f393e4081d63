"""The run folder: everything of a run, readable without this package, there whole or not at all.

While a run is under way its folder has `.partial` at the end of its name; a scheme's file appears there as soon as the
scheme is complete, so that an interrupted run goes on where it stopped. The last step is one rename.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.errors import ConfigError, RislamError, StoreError
from rislam_rt.model import MapEstimate, Scene, SchemeResult, SlamResult, Trajectory
from rislam_rt.pipeline.dataset import (
    dataset_to_paths,
    dataset_to_scheme,
    paths_to_dataset,
    read_dataset,
    scheme_to_dataset,
    write_dataset,
)
from rislam_rt.pipeline.files import write_atomic
from rislam_rt.pipeline.run import library_versions
from rislam_rt.pipeline.spec import PipelineSpec
from rislam_rt.scene import load_scene, write_scene
from rislam_rt.scene.write import toml_bytes, tum_bytes

RUN_FILE, PATHS_FILE, SUMMARY_FILE = "run.json", "paths.nc", "summary.json"


class PartialRun(MutableMapping[str, SchemeResult]):
    """Schemes of a run that is under way, on disk. One that cannot be read counts as not there, and runs again."""

    def __init__(self, folder: Path, identity: str) -> None:
        """Open the partial folder; one of another identity (other settings, room or versions) is emptied."""
        self.final = folder
        self.folder = folder.with_name(folder.name + ".partial")
        mark = self.folder / "identity"
        try:
            if self.folder.exists() and not (mark.is_file() and mark.read_text() == identity):
                shutil.rmtree(self.folder)
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _refused(self.folder, error) from None
        write_atomic(mark, identity.encode())

    def __getitem__(self, name: str) -> SchemeResult:
        file = scheme_file(self.folder, name)
        if not file.is_file():
            raise KeyError(name)
        try:
            return dataset_to_scheme(read_dataset(file))
        except (RislamError, KeyError):
            raise KeyError(name) from None

    def __setitem__(self, name: str, result: SchemeResult) -> None:
        write_dataset(scheme_to_dataset(result), scheme_file(self.folder, name))

    def __delitem__(self, name: str) -> None:
        scheme_file(self.folder, name).unlink()

    def __iter__(self) -> Iterator[str]:
        files = self.folder.glob("scheme_*.nc")
        return iter(sorted(file.stem.removeprefix("scheme_") for file in files))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        try:
            return isinstance(name, str) and self[name] is not None
        except KeyError:
            return False

    def abandon(self) -> None:
        """Remove the folder if no scheme was completed."""
        if not len(self):
            shutil.rmtree(self.folder, ignore_errors=True)

    def complete(self, result: SlamResult, summary: dict[str, Any]) -> Path:
        """Add what the schemes' files do not hold and give the folder its final name. Returns it.

        Raises
        ------
        StoreError
            The disk refused.
        """
        write_exports(result, summary, self.folder)
        try:
            (self.folder / "identity").unlink(missing_ok=True)
            if self.final.exists():
                aside = self.final.with_name(self.final.name + ".old")
                shutil.rmtree(aside, ignore_errors=True)
                self.final.rename(aside)
                self.folder.rename(self.final)
                shutil.rmtree(aside, ignore_errors=True)
            else:
                self.folder.rename(self.final)
        except OSError as error:
            raise _refused(self.final, error) from None
        return self.final


def run_folder(spec: PipelineSpec, scene: Scene, parent: Path) -> Path:
    """`<pipeline>-<scene>-<seed>` below the folder of all runs."""
    return parent / f"{spec.name}-{scene.name}-{spec.seed}"


def run_identity(spec: PipelineSpec, scene: Scene) -> str:
    """What must be equal for a scheme's file to be taken over: settings, room, versions; not the list of schemes."""
    config = spec.model_dump(mode="json", exclude={"schemes", "description", "scene"})
    content = json.dumps([config, scene.digest, library_versions()], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


def check_folder(folder: Path) -> None:
    """Refuse a folder that holds something other than a run, which the new run would replace.

    Raises
    ------
    ConfigError
        It does.
    """
    if folder.exists() and not (folder / RUN_FILE).is_file() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(f"--out {folder}: exists and is not a run; give a folder that does not exist yet")


def scheme_file(folder: Path, name: str) -> Path:
    """Where a scheme's data set lies."""
    return folder / f"scheme_{name}.nc"


def write_exports(result: SlamResult, summary: dict[str, Any], folder: Path) -> None:
    """Paths, trajectories, maps, room, configuration and summary."""
    motion = result.scene.agent
    write_dataset(paths_to_dataset(result.paths, motion), folder / PATHS_FILE)
    write_atomic(folder / "truth.tum", tum_bytes(motion.time, motion.position, motion.heading))
    for name, scheme in result.schemes.items():
        write_atomic(folder / f"estimate_{name}.tum", tum_bytes(motion.time, scheme.position, scheme.heading))
    maps = {name: map_table(scheme.map) for name, scheme in result.schemes.items()}
    write_atomic(folder / "map.json", _json(maps))
    write_atomic(folder / "config.toml", toml_bytes(_without_none({**result.config})))
    write_scene(result.scene, folder / "scene", overwrite=True)
    about = {
        "name": result.name,
        "seed": result.seed,
        "scene": {"name": result.scene.name, "sha256": result.scene.digest},
        "cycles": len(motion),
        "schemes": list(result.schemes),
        "versions": dict(result.versions),
        "seconds": dict(result.seconds),
        "warnings": list(result.warnings),
        "config": dict(result.config),
    }
    write_atomic(folder / SUMMARY_FILE, _json(summary))
    write_atomic(folder / RUN_FILE, _json(about))


def read_run(folder: Path) -> SlamResult:
    """A completed run.

    Raises
    ------
    StoreError
        One of its files is missing or damaged.
    ConfigError
        The folder is not a completed run.
    """
    if not (folder / RUN_FILE).is_file():
        raise ConfigError(f"{folder}: not a completed run (no {RUN_FILE}); give a folder that `run` wrote")
    try:
        about = json.loads((folder / RUN_FILE).read_text())
        names = [str(name) for name in about["schemes"]]
        data = read_dataset(folder / PATHS_FILE)
        paths, scene = dataset_to_paths(data), load_scene(folder / "scene")
        agent = Trajectory(
            data["time"].to_numpy(),
            data["true_position"].to_numpy(),
            data["true_velocity"].to_numpy(),
            data["true_heading"].to_numpy(),
            scene.agent.body,
        )
        schemes = {name: dataset_to_scheme(read_dataset(scheme_file(folder, name))) for name in names}
        return SlamResult(
            name=about["name"],
            scene=Scene(scene.name, scene.reflectors, scene.scatterers, scene.ris, agent, about["scene"]["sha256"]),
            paths=paths,
            schemes=schemes,
            config=about["config"],
            seed=about["seed"],
            versions=about["versions"],
            seconds=about["seconds"],
            warnings=tuple(about["warnings"]),
        )
    except StoreError:
        raise
    except (OSError, ValueError, KeyError, TypeError, RislamError) as error:
        cause = f"{type(error).__name__}: {error}"[:120]
        raise StoreError(f"{folder}: a file of the run is damaged ({cause}); run again") from None


def map_table(estimate: MapEstimate) -> dict[str, Any]:
    """A map as plain lists: landmarks, their images, walls."""
    std = np.sqrt(np.einsum("nii->ni", estimate.covariance))
    features = [
        {
            "ident": int(estimate.ident[row]),
            "position_m": estimate.position[row].tolist(),
            "std_m": std[row].tolist(),
            "image_of": int(estimate.ident[estimate.parent[row]]) if estimate.parent[row] >= 0 else None,
            "ris_probability": float(estimate.ris_probability[row]),
            "strength": float(estimate.strength[row]),
        }
        for row in range(len(estimate.ident))
    ]
    walls = [
        {"normal": normal.tolist(), "offset_m": float(offset), "angle_std_rad": float(a), "offset_std_m": float(b)}
        for normal, offset, (a, b) in zip(estimate.wall_normal, estimate.wall_offset, estimate.wall_std, strict=True)
    ]
    return {"landmarks": features, "walls": walls}


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    """TOML has no null: what is not set is left out."""
    return {
        key: _without_none(value) if isinstance(value, dict) else value
        for key, value in table.items()
        if value is not None
    }


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


def _refused(path: Path, error: OSError) -> StoreError:
    return StoreError(f"{path}: cannot be written ({error.strerror}); check permissions and free space")
