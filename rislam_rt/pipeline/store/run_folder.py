"""The run folder: writes and reads all files of a run, and refuses folders that hold anything else.

`run.json` is its marker: it holds the run's whole identity, whether the run is `running` or `done`, and the SHA-256 of
every file. A scheme's file appears as soon as the scheme is complete, so that an interrupted run goes on where it was.
One process at a time writes there.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rislam_rt.errors import ConfigError, ResultError, RislamError, StoreError
from rislam_rt.model import Paths, Scene, SchemeResult, SlamResult, Trajectory
from rislam_rt.pipeline import run_datasets
from rislam_rt.pipeline.recordings.inputs import given_to_dataset
from rislam_rt.pipeline.store.exports import SUMMARY_FILE, export_files
from rislam_rt.pipeline.store.identity import RunIdentity
from rislam_rt.scene import load_scene
from rislam_rt.storage.checksums import file_digest, read_sealed, seal
from rislam_rt.storage.files import has_marker, json_file, make_folders, remove_empty, remove_temporaries, write_atomic
from rislam_rt.storage.lock import LOCK_FILE, hold
from rislam_rt.storage.netcdf import dataset_bytes, read_dataset

RUN_FILE, PATHS_FILE = "run.json", "paths.nc"
RUNNING, DONE = "running", "done"
"""States of a run in its marker file."""
OWN_FOLDERS = ("", "figures", "scene", "scene/meshes")
"""Folders below the run folder in which files are written."""


class RunFolder(MutableMapping[str, SchemeResult]):
    """Results of a run's schemes on disk, by name; writes them, and treats a file that was changed as missing."""

    def __init__(self, folder: Path, identity: RunIdentity, files: Mapping[str, str] | None = None) -> None:
        """Open a folder of a run of that identity; `files` are the SHA-256 by name of files written before."""
        self.folder, self.identity, self.files = folder, identity, dict(files or {})

    def __getitem__(self, name: str) -> SchemeResult:
        file = scheme_file(self.folder, name)
        if self.holds([file.name]):
            with suppress(RislamError):
                return _read_scheme(file, name, self.identity.digest)
        raise KeyError(name)

    def __setitem__(self, name: str, result: SchemeResult) -> None:
        data = run_datasets.seal_dataset(run_datasets.scheme_to_dataset(result), **self._stamp())
        if result.given is not None:
            given = run_datasets.seal_dataset(given_to_dataset(result), **self._stamp())
            self.put(run_datasets.part_name("measurements", name), dataset_bytes(given))
        self.put(scheme_file(self.folder, name).name, dataset_bytes(data))
        self.mark(RUNNING)

    def __delitem__(self, name: str) -> None:
        file = scheme_file(self.folder, name)
        file.unlink()
        self.files.pop(file.name, None)

    def __iter__(self) -> Iterator[str]:
        schemes = (file for file in sorted(self.files) if file.startswith("scheme_"))
        return (file.removeprefix("scheme_").removesuffix(".nc").replace("@", ":") for file in schemes)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def spoiled(self) -> list[str]:
        """Names of schemes whose files in the run folder were changed since they were written; they run again."""
        return [name for name in self if name not in self]

    def mark(self, state: str, more: Mapping[str, Any] | None = None) -> None:
        """Write the run folder's marker file with its state, identity, the SHA-256 of all files, and `more`.

        Raises
        ------
        StoreError
            The disk refused.
        """
        about = {"state": state, "identity": self.identity.digest, **self.identity.content, **(more or {})}
        write_atomic(self.folder / RUN_FILE, json_file(seal({**about, "files": self.files}), indent=2))

    def complete(self, result: SlamResult, summary: Mapping[str, Any]) -> Path:
        """Write true paths, exports and, last, the marker of a run whose schemes are all there; return the folder.

        Raises
        ------
        StoreError
            The disk refused.
        """
        paths = run_datasets.seal_dataset(
            run_datasets.paths_to_dataset(result.paths, result.scene.agent), **self._stamp()
        )
        self.put(PATHS_FILE, dataset_bytes(paths))
        for name, content in export_files(result, summary, self.identity.content.get("own", {})).items():
            self.put(name, content)
        told = {
            "name": result.name, "seed": result.seed, "cycles": len(result.scene.agent),
            "schemes": list(result.schemes), "seconds": dict(result.seconds), "warnings": list(result.warnings),
            "config": dict(result.config),
        }  # fmt: skip
        self.mark(DONE, told)
        return self.folder

    def put(self, name: str, content: bytes) -> None:
        """Write a file into the run folder, and note its SHA-256."""
        write_atomic(self.folder / name, content)
        self.files[name] = hashlib.sha256(content).hexdigest()

    def adopt(self, names: Iterable[str]) -> None:
        """Note the SHA-256 of files that are in the run folder already, and write the marker."""
        self.files |= {name: file_digest(self.folder / name) for name in names}
        self.mark(RUNNING)

    def holds(self, names: Iterable[str]) -> bool:
        """Whether all these files are in the run folder, unchanged since they were written."""
        try:
            return all(name in self.files and file_digest(self.folder / name) == self.files[name] for name in names)
        except ResultError:
            return False

    def _stamp(self) -> dict[str, str]:
        return {"run": self.identity.digest, "scene_sha256": self.identity.content["scene"]["sha256"]}


def find_run(folder: Path, identity: RunIdentity) -> dict[str, Any] | None:
    """Read the marker of a run folder and check that its identity is this one; None if the folder is missing or empty.

    Raises
    ------
    ConfigError
        It holds something else, or a run of another identity: nothing there may be replaced.
    ResultError
        The marker is not as it was written.
    """
    if not has_marker(folder, RUN_FILE, LOCK_FILE, "run", "--out "):
        if folder.is_symlink() and not folder.exists():
            raise ConfigError(f"--out {folder}: a link to nothing; mend it, or give another folder")
        return None
    about = read_marker(folder)
    if about.get("identity") != identity.digest:
        differ = identity.difference({key: about.get(key, {}) for key in identity.content})
        raise ConfigError(f"--out {folder}: holds another run ({differ}); give another folder")
    return about


def read_marker(folder: Path) -> dict[str, Any]:
    """Read the marker file of a run folder: its state, identity and the SHA-256 of its files.

    Raises
    ------
    ResultError
        It is not as it was written, or holds none of these.
    """
    about = read_sealed(folder / RUN_FILE)
    files = about.get("files")
    named = isinstance(files, dict) and all(isinstance(digest, str) for digest in files.values())
    if not named or about.get("state") not in (RUNNING, DONE) or not isinstance(about.get("identity"), str):
        raise ResultError(f"{folder / RUN_FILE}: no state, identity or files as a run writes them; give another folder")
    return about


@contextmanager
def open_run(folder: Path, identity: RunIdentity) -> Iterator[RunFolder]:
    """Open or create the folder of a run for writing, locked against other processes.

    Raises
    ------
    ConfigError
        It holds something else, or another process is at work there.
    ResultError
        Its marker is not as it was written.
    StoreError
        The disk refused.
    """
    find_run(folder, identity)
    try:
        made = make_folders(folder)
    except StoreError as error:
        raise StoreError(f"--out {error}") from None
    try:
        with hold_run(folder):
            about = find_run(folder, identity)
            store = RunFolder(folder, identity, about["files"] if about else None)
            try:
                store.mark(RUNNING)
                yield store
            except BaseException:
                if not store.files:  # nothing was completed
                    (folder / RUN_FILE).unlink(missing_ok=True)
                raise
    finally:
        remove_empty(made)


@contextmanager
def hold_run(folder: Path) -> Iterator[None]:
    """Lock a run folder against other processes, and remove temporary files that a killed process left there.

    Raises
    ------
    ConfigError
        Another process is at work there.
    StoreError
        The disk refused.
    """
    with hold(folder, "run"):
        remove_temporaries([*(folder / part for part in OWN_FOLDERS), *folder.glob("slices/*")])
        yield


def check_files(folder: Path, about: Mapping[str, Any]) -> None:
    """Check that no file in the folder of a completed run was changed since it was written.

    Raises
    ------
    ResultError
        One was, or is missing. One line that names it.
    """
    for name, digest in about["files"].items():
        if file_digest(folder / name) != digest:
            raise ResultError(f"{folder / name}: changed since it was written; run again with another --out")


def read_summary(folder: Path, about: Mapping[str, Any]) -> dict[str, Any]:
    """Read the scores of a completed run from its folder, after checking all files.

    Raises
    ------
    ResultError
        A file was changed.
    """
    check_files(folder, about)
    return dict(json.loads((folder / SUMMARY_FILE).read_bytes()))


def scheme_file(folder: Path, name: str) -> Path:
    """Path of a scheme's NetCDF file in the run folder."""
    return run_datasets.part_file(folder, "scheme", name)


def read_run(folder: Path) -> SlamResult:
    """Read a completed run from its folder, after checking all files.

    Raises
    ------
    ResultError
        One of its files is missing, damaged or changed.
    ConfigError
        The folder is not a completed run.
    """
    if not (folder / RUN_FILE).is_file():
        raise ConfigError(f"{folder}: not a completed run (no {RUN_FILE}); give a folder that `run` wrote")
    about = read_marker(folder)
    with reading_run(folder):
        if about["state"] != DONE:
            raise ConfigError(f"{folder}: not a completed run; the command that began it goes on with it")
        check_files(folder, about)
        data = read_dataset(folder / PATHS_FILE)
        run_datasets.check_dataset(data, folder / PATHS_FILE, run=about["identity"], cycles=about["cycles"])
        paths, scene = run_datasets.dataset_to_paths(data), read_room(folder, about)
        time, position, velocity, heading = (data[name].to_numpy() for name in run_datasets.TRAJECTORY)
        agent = Trajectory(time, position, velocity, heading, scene.agent.body)
        schemes = {
            name: _read_scheme(scheme_file(folder, name), name, about["identity"], about["cycles"])
            for name in about["schemes"]
        }
        return result_of_marker(about, replace(scene, agent=agent), paths, schemes)


def read_room(folder: Path, about: Mapping[str, Any]) -> Scene:
    """Read the room of a run from its folder, with the SHA-256 of the files that it was made from."""
    return replace(load_scene(folder / "scene"), digest=about["scene"]["sha256"])


def result_of_marker(
    about: Mapping[str, Any], scene: Scene, paths: Paths, schemes: Mapping[str, SchemeResult]
) -> SlamResult:
    """Result of a run from what its folder's marker says, and what the other files hold."""
    told: dict[str, Any] = {name: about[name] for name in ("name", "seed", "config", "versions", "seconds")}
    return SlamResult(scene=scene, paths=paths, schemes=schemes, warnings=tuple(about["warnings"]), **told)


@contextmanager
def reading_run(folder: Path) -> Iterator[None]:
    """Turn whatever a damaged file raises while a run folder is read within this context into a one-line error.

    Raises
    ------
    ResultError
        A file is damaged.
    """
    try:
        yield
    except (ConfigError, ResultError):
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RislamError) as error:
        cause = f"{type(error).__name__}: {error}"[:120]
        raise ResultError(f"{folder}: a file of the run is damaged ({cause}); run again with another --out") from None


def _read_scheme(file: Path, name: str, run: str, cycles: int | None = None) -> SchemeResult:
    """Read a scheme's result from its NetCDF file in the run folder, and check that it is of this scheme and run."""
    data = read_dataset(file)
    run_datasets.check_dataset(data, file, scheme=name, run=run, **({} if cycles is None else {"cycles": cycles}))
    return run_datasets.dataset_to_scheme(data)
