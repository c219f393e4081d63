"""Conversion of a study in unseen rooms to a sweep over rooms, variants and SNRs, and the ledger of test runs."""

import csv
import hashlib
import io
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from rislam_rt.errors import StoreError
from rislam_rt.pipeline.own_method_files import own_digests
from rislam_rt.pipeline.run import library_versions
from rislam_rt.pipeline.store.identity import code_digest
from rislam_rt.scene.random_rooms import draw_room
from rislam_rt.storage.files import csv_file, write_atomic
from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.studies.swept.sweep import SNR, checked_settings
from rislam_rt.studies.unseen.cell import FUNCTION, scheme_here
from rislam_rt.studies.unseen.spec import UnseenSpec
from rislam_rt.sweeps import Axis, Sweep

LEDGER = ("date", "first", "rooms", "snr_db", "variants", "code", "settings")
"""Columns of the ledger in which runs of test rooms are counted."""
CODE_DIGITS = 16
"""Number of digits of the code's hash in the ledger."""


def build_unseen(spec: UnseenSpec, pipeline: Path, data: Path) -> Sweep:
    """Build the sweep of a study in unseen rooms, rooms outermost, so that the paths of each are found once.

    All random numbers come from the rooms' seeds.

    Parameters
    ----------
    pipeline
        The study's file.
    data
        Folder of the saved outputs, if there are to be any.
    """
    seeds = range(spec.first, spec.first + spec.rooms)
    axes = [Axis("room", tuple(seeds))]
    if spec.variants:
        axes.append(Axis("variant", tuple(variant.name for variant in spec.variants)))
    axes.append(Axis(SNR, tuple(spec.snr_db)))
    variants = {variant.name: dict(variant.set) for variant in spec.variants}
    base = {"run": spec.run_settings, "save": spec.save, "ways": spec.ways}
    local = {"variants": variants, "data": str(data.absolute())}
    keys = tuple(axis.key for axis in axes)
    return Sweep(FUNCTION, tuple(axes), base, 1, spec.seed, keys, local, _depends(pipeline, local), spec.name)


def _depends(pipeline: Path, local: Mapping[str, Any]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Function that checks the settings of a cell in unseen rooms, and returns all that its result depends on:
    settings, room, code."""
    draw, versions, code, digests = cache(draw_room), library_versions(), code_digest(), cache(own_digests)

    def depends(settings: Mapping[str, Any]) -> dict[str, Any]:
        spec, room = cell_spec({**settings, **local}, pipeline), draw(int(settings["room"]), settings["ways"])
        here = [scheme_here(name, room) for name in spec.schemes]
        found = checked_settings(room.scene, spec, here, f"{pipeline}: room {settings['room']}", digests)
        return {**found, "room_sha256": room.scene.digest, "versions": versions, "code": code}

    return depends


def count_tests(spec: UnseenSpec, pipeline: Path) -> int:
    """Add a run of test rooms to the ledger unless it is there, and return how often test rooms were run in all.

    Runs of development rooms are not added.

    Raises
    ------
    StoreError
        The ledger cannot be read or written.
    """
    file = pipeline.parent / spec.ledger
    try:
        rows = list(csv.DictReader(io.StringIO(file.read_text(encoding="utf-8")))) if file.exists() else []
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: cannot be read ({type(error).__name__}); mend or move it") from None
    if not spec.is_test:
        return len(rows)
    config = spec.model_dump_json(exclude={"name", "description", "time_limit_s", "save", "ledger"})
    settings = hashlib.sha256(config.encode()).hexdigest()[:16]
    if any((row["code"], row["settings"]) == (code_digest()[:CODE_DIGITS], settings) for row in rows):
        return len(rows)
    names = " ".join(variant.name for variant in spec.variants)
    entry = (datetime.now(UTC).date(), spec.first, spec.rooms, " ".join(f"{snr:g}" for snr in spec.snr_db), names)
    known = [[row[name] for name in LEDGER] for row in rows]
    write_atomic(file, csv_file(LEDGER, [*known, [*entry, code_digest()[:CODE_DIGITS], settings]]))
    return len(rows) + 1


def unseen_record(spec: UnseenSpec) -> dict[str, Any]:
    """Record for JSON of what is needed to repeat a study in unseen rooms: settings, versions, hash of the code."""
    return {
        "kind": spec.kind, "name": spec.name, "versions": library_versions(), "code": code_digest(),
        "config": spec.model_dump(mode="json"),
        "settings": cell_spec({"run": spec.run_settings, "variants": {}}).model_dump(mode="json"),
    }  # fmt: skip
