"""Answers of an estimator to a user's own measurements: as files (estimate.tum, estimate.csv, map.json), in short, and
beside true poses."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.recordings.replay import Answers
from rislam_rt.pipeline.scores.loss_causes import LossTally, words_of_loss
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.recorded_poses import parse_csv, parse_tum
from rislam_rt.scene.write import tum_bytes
from rislam_rt.storage.checksums import file_digest
from rislam_rt.storage.files import csv_file, json_file

COLUMNS = (
    "time_s", "x_m", "y_m", "z_m", "std_x_m", "std_y_m", "std_z_m", "heading_rad", "components", "outcome",
    "std_heading_rad", "cov_xy_m2",
)  # fmt: skip
"""Columns of `estimate.csv`, a row a cycle; docs/own_measurements.md says what they are."""


def summarise_answers(inputs: Inputs, answers: Answers, true: Floats | None = None) -> dict[str, Any]:
    """What `rislam-rt slam` says on the screen of an estimator's answers to measurements, by name; `rmse_m` where true
    positions (K, 3) [m] are given."""
    last = answers.estimates[-1]
    outcomes, tally = [str(info.outcome) for info in answers.infos], LossTally()
    tally.add(inputs.time, outcomes, [getattr(info, "cause", 0) for info in answers.infos])
    panels = 1 if inputs.panel is None else len(inputs.panel.panels)
    found: dict[str, Any] = {
        "cycles": len(inputs.time),
        "components": sum(len(m) for m in inputs.measurements),
        "ended": outcomes[-1],
        "cycles_diverged": outcomes.count("diverged"),
        **({"lost_because": words_of_loss(tally.scores(float(inputs.time[0])))} if tally.causes else {}),
        "last_position_m": [round(float(value), 4) for value in last.position],
        "deviation_m": float(np.sqrt(np.trace(last.covariance[:2, :2]))),
        "landmarks": int(np.sum(last.map.parent < 0)),
        "walls": len(last.map.wall_offset),
        "panel_found": all(last.map.panel_row(panel) >= 0 for panel in range(panels)),
        "ms_a_cycle": 1000.0 * answers.seconds,
    }
    if true is not None:
        error = np.array([one.position for one in answers.estimates]) - true
        found["rmse_m"] = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    return found


def about_answers(
    inputs: Inputs, spec: PipelineSpec, file: Path, versions: Mapping[str, str]
) -> dict[str, Any]:  # fmt: skip
    """What the answers of an estimator to the measurements of a file were made from: scheme, settings, start, Tx and
    Rx, `versions` of the libraries, and the file's name and SHA-256."""
    start, body = inputs.start, inputs.body
    return {
        "scheme": spec.schemes[0],
        "input": {"file": file.name, "sha256": file_digest(file)},
        "start": {field.name: np.asarray(getattr(start, field.name)).tolist() for field in fields(start)},
        "body": {"tx_m": body.tx_offset.tolist(), "rx_m": body.rx_offset.tolist()},
        "config": spec.model_dump(),
        "versions": dict(versions),
    }


def answer_files(inputs: Inputs, answers: Answers) -> dict[str, bytes]:
    """Contents of the files of `rislam-rt slam` by name: the estimated way as TUM and as CSV with `COLUMNS`, and the
    last map as JSON, a list for each field of `MapEstimate` (null for what is no finite number)."""
    times = inputs.time + inputs.since
    position = np.array([one.position for one in answers.estimates])
    heading = np.array([one.heading for one in answers.estimates])
    rows = []
    for time, one, info, heard in zip(times, answers.estimates, answers.infos, inputs.measurements, strict=True):
        std = np.sqrt(np.maximum(np.diag(one.covariance)[:3], 0.0))
        numbers = [*one.position, *std, one.heading]
        more = "" if one.heading_std is None else f"{one.heading_std:.9g}", f"{one.covariance[0, 1]:.9g}"
        rows.append([repr(float(time)), *(f"{value:.9g}" for value in numbers), len(heard), info.outcome, *more])
    last = answers.estimates[-1].map
    known = {field.name: value for field in fields(last) if (value := getattr(last, field.name)) is not None}
    content = {name: np.asarray(np.where(np.isfinite(value), value, None)).tolist() for name, value in known.items()}
    return {
        "estimate.tum": tum_bytes(times, position, heading),
        "estimate.csv": csv_file(COLUMNS, rows),
        "map.json": json_file(content),
    }


def true_positions(file: Path, cycles: Floats) -> Floats:
    """True positions (K, 3) [m] for `rislam-rt slam` from the TUM or CSV file of `--truth`, one at each of the cycles'
    times (K,) [s].

    Raises
    ------
    ConfigError
        The file cannot be read, or has no pose within half a cycle of each time; the line says which.
    """
    try:
        content = file.read_bytes()
        time, position = (parse_csv(content, {}) if file.suffix.lower() == ".csv" else parse_tum(content))[:2]
    except OSError as error:
        raise ConfigError(f"--truth {file}: cannot be read ({error.strerror}); give a TUM or CSV file") from None
    except Fault as fault:
        raise ConfigError(fault.at(f"--truth {file}", "").line) from None
    if len(position) != len(cycles):
        raise ConfigError(f"--truth {file}: {len(position)} poses for {len(cycles)} cycles; give one a cycle")
    apart = np.abs(time - cycles)
    if len(cycles) > 1 and apart.max() > 0.5 * float(np.median(np.diff(cycles))):
        pose = int(np.argmax(apart))
        what = f"pose {pose} is at {time[pose]:.10g} s, its cycle at {cycles[pose]:.10g} s"
        raise ConfigError(f"--truth {file}: {what}, more than half a cycle apart; give both by one clock")
    return position
