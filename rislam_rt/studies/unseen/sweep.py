"""Conversion of a study in unseen rooms to a sweep over rooms, variants and SNRs, and the ledger of test runs."""

import csv
import hashlib
import io
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from rislam_rt.errors import RislamError, StoreError
from rislam_rt.pipeline.own_methods import own_digests
from rislam_rt.pipeline.run import check_run, library_versions
from rislam_rt.pipeline.store.identity import code_digest
from rislam_rt.scene.random_rooms import draw_room
from rislam_rt.storage.files import csv_file, write_atomic
from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.studies.unseen.cell import FUNCTION, scheme_here
from rislam_rt.studies.unseen.spec import UnseenSpec
from rislam_rt.sweeps import Axis, Sweep

SNR = "run.radio.reference_snr_db"
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
    base = {"run": dict(spec.run), "save": spec.save}
    local = {"variants": variants, "data": str(data.absolute())}
    keys = tuple(axis.key for axis in axes)
    depends = _Depends(pipeline, local)
    return Sweep(FUNCTION, tuple(axes), base, 1, spec.seed, keys, local, depends, spec.name)


class _Depends:
    """Function that checks a cell's settings, and returns all that its result depends on.

    These are the settings with defaults filled in, the hash of the room, the versions and the hash of the code.
    """

    def __init__(self, pipeline: Path, local: Mapping[str, Any]) -> None:
        self.pipeline, self.local = pipeline, local
        self.room, self.versions, self.code = cache(draw_room), library_versions(), code_digest()

    def __call__(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        spec, room = cell_spec({**settings, **self.local}, self.pipeline), self.room(int(settings["room"]))
        here = [scheme_here(name, room) for name in spec.schemes]
        try:
            check_run(room.scene, spec.model_copy(update={"schemes": here}))
        except RislamError as error:
            raise type(error)(f"{self.pipeline}: room {settings['room']}: {error}") from None
        config = spec.model_dump(mode="json", exclude={"name", "description", "scene", "seed"})
        own = own_digests([*spec.schemes, spec.channel])
        told = {"config": config, "room_sha256": room.scene.digest, "versions": self.versions, "code": self.code}
        return told | ({"own": own} if own else {})


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
        "kind": spec.kind,
        "name": spec.name,
        "versions": library_versions(),
        "code": code_digest(),
        "config": spec.model_dump(mode="json"),
        "settings": cell_spec({"run": spec.run, "variants": {}}).model_dump(mode="json"),
    }
