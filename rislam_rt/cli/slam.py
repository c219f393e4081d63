"""The command `rislam-rt slam MEASUREMENTS`: estimates pose and map from a user's own or recorded measurements."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rislam_rt.cli.options import MAIN_JOB, JsonFile, Settings, parse_point, pipeline_file
from rislam_rt.cli.output_files import write_json
from rislam_rt.cli.verbosity import warn
from rislam_rt.constants import MAX_SPEED
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import parse_number
from rislam_rt.storage.files import check_writable

if TYPE_CHECKING:
    from rislam_rt.model import Body
    from rislam_rt.pipeline.recordings.inputs import Inputs
    from rislam_rt.slam import StartPrior


LONGEST_ARM = 2.0
"""Distance [m] of Tx and Rx from the agent's position above which a unit is wrong."""
TURN_DEG = 360.0
"""Largest start heading [degrees] of either sign, as `heading_deg` in a scene."""


def command(
    measurements: Annotated[
        Path, typer.Argument(metavar="MEASUREMENTS", help="CSV or NetCDF file of components.", show_default=False)
    ],
    config: Annotated[
        Path, typer.Option(metavar="PIPELINE", help="Radio, receiver and filter, as for `run`.", parser=pipeline_file)
    ] = MAIN_JOB,
    set_: Settings = None,
    start: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Where the agent starts, in m; a NetCDF file brings its own."),
    ] = None,
    velocity: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Its first velocity, in m/s; at rest if left out.")
    ] = None,
    heading: Annotated[
        str | None,
        typer.Option(
            metavar="DEG",
            help="Its first heading, in degrees from x towards y, where there is no compass; if left out, the "
            "direction of --velocity, as well as that is known.",
        ),
    ] = None,
    tx: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Tx from the agent's position in m, x forward, y left, z up; a CSV file needs it.",
        ),
    ] = None,
    rx: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Centre of the Rx array, likewise.")] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="FILE", help="True poses (TUM, CSV), one a cycle, for scoring alone.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="New folder for the estimate; <file>-slam, in the working folder, by default."
        ),
    ] = None,
    json: JsonFile = None,
) -> None:
    """Localise and map from measurements of your own: no scene is needed.

    The columns of a CSV file are listed in docs/own_measurements.md; delays are in seconds, angles of arrival as
    direction cosines or in radians, body frame. How well the start is known is set by start.position_std_m,
    start.velocity_std_m_s and start.heading_std_deg (0: a heading that is given is exact; one taken from --velocity
    has at least the deviation that the velocity's own gives its direction). Without a compass, a column heading_rad,
    set slam.heading=estimated.

    A run's folder holds its measurements, too: with its config.toml they give the run's estimate again.

    Example: rislam-rt slam mine.csv --start 0.5,0.7,0.5 --tx -0.05,0,0 --rx 0.05,0,0 --set radio.noise_psd=1e-12

    Example: rislam-rt slam RUN/measurements_random.nc --config RUN/config.toml --truth RUN/truth.tum
    """
    import numpy as np

    from rislam_rt.pipeline import load_spec
    from rislam_rt.pipeline.estimators import use_directions
    from rislam_rt.pipeline.recordings.answer_files import (
        about_answers,
        answer_files,
        summarise_answers,
        true_positions,
    )
    from rislam_rt.pipeline.recordings.measurement_warnings import input_warnings
    from rislam_rt.pipeline.recordings.own_measurements import localise, read_inputs, run_rng
    from rislam_rt.pipeline.room.array_warnings import array_warnings
    from rislam_rt.pipeline.run import library_versions
    from rislam_rt.pipeline.schemes import SCHEMES
    from rislam_rt.pipeline.specification.radio import build_radio
    from rislam_rt.storage.files import json_file, write_all
    from rislam_rt.storage.netcdf import NETCDF

    spec = load_spec(config, set_ or ())
    stds = (spec.start.position_std_m, spec.start.velocity_std_m_s, float(np.deg2rad(spec.start.heading_std_deg)))
    prior = None if start is None else _prior(start, velocity or "0,0,0", stds, heading)
    options = {"--start": start, "--velocity": velocity, "--heading": heading, "--tx": tx, "--rx": rx}
    given = [option for option, value in options.items() if value is not None]
    if given and measurements.suffix.lower() in NETCDF:
        raise ConfigError(f"{', '.join(given)}: {measurements} brings its own start, Tx and Rx; leave it out")
    body = _body(tx, rx)
    radio = build_radio(spec.radio)
    inputs = read_inputs(measurements, prior, radio, body)
    if prior is not None:
        if body is None:  # a baseline that is not the agent's own is an error of centimetres that no deviation shows
            where = "a CSV file does not say where Tx and Rx sit on the agent"
            raise ConfigError(f"{measurements}: {where}; give --tx X,Y,Z and --rx X,Y,Z (m; x forward, y left, z up)")
        inputs = _with_heading(inputs, heading, spec.slam.heading, measurements)
    told = array_warnings(radio, "radio") if use_directions(spec.schemes[:1]) else ()  # of which the estimator is
    blind = (found.line.partition(": ")[2] for found in told)
    for line in (*input_warnings(inputs, spec), *blind):
        warn(f"{measurements}: {line}")
    for name in spec.schemes[1:]:
        if SCHEMES[name].estimator != SCHEMES[spec.schemes[0]].estimator:
            warn(f"schemes: '{name}' is passed over: the estimator is that of the first, '{spec.schemes[0]}'")
    true = None if truth is None else true_positions(truth, inputs.time + inputs.since)
    folder = _new_folder(out or Path(f"{measurements.stem}-slam"))
    drawn = None if any(word.startswith("seed=") for word in set_ or ()) else run_rng(measurements)
    answers = localise(inputs, spec, rng=drawn or np.random.default_rng(spec.seed), place=str(measurements))
    summary = {"scheme": spec.schemes[0], **summarise_answers(inputs, answers, true)}
    files = {
        **answer_files(inputs, answers),
        "about.json": json_file(about_answers(inputs, spec, measurements, library_versions()), indent=2),
    }
    write_all(_new_folder(folder), files)  # another command may have filled it meanwhile
    for name, value in summary.items():
        typer.echo(f"{name}: {f'{value:.4g}' if isinstance(value, float) else value}")
    typer.echo(f"folder: {folder}")
    write_json(json, summary)


def _prior(start: str, velocity: str, stds: tuple[float, float, float], heading: str | None = None) -> "StartPrior":
    """Start prior for `rislam-rt slam` from the options `--start`, `--velocity` and `--heading`; without a heading, it
    is along the velocity."""
    import numpy as np

    from rislam_rt.slam import StartPrior

    first, speed = parse_point("--start", start), parse_point("--velocity", velocity)
    if np.linalg.norm(speed) > MAX_SPEED:
        warn(f"--velocity: {np.linalg.norm(speed):.3g} m/s; give metres a second")
    if heading is None:
        return StartPrior(first, speed, float(np.arctan2(speed[1] + 0.0, speed[0] + 0.0)), *stds)
    try:
        degrees = parse_number(heading)
    except ValueError:
        degrees = np.nan
    if not abs(degrees) <= TURN_DEG:
        raise ConfigError(f"--heading: '{heading[:60]}' received; give degrees from -{TURN_DEG:g} to {TURN_DEG:g}")
    return StartPrior(first, speed, float(np.deg2rad(degrees)), *stds)


def _with_heading(inputs: "Inputs", heading: str | None, mode: str, measurements: Path) -> "Inputs":
    """Inputs of `rislam-rt slam` with the start heading of the option `--heading`, which must not contradict a compass;
    without either, the direction of the velocity and its deviation where the heading is estimated."""
    import numpy as np

    from rislam_rt.slam.start_prior import heading_from_velocity

    compass = not np.isnan(inputs.heading).any()
    if compass and heading is not None:
        raise ConfigError(
            f"--heading: {measurements} has a compass (heading_rad), whose first row is the start's; leave one out"
        )
    if compass or heading is not None or mode != "estimated":
        return inputs
    return inputs._replace(start=heading_from_velocity(inputs.start))


def _body(tx: str | None, rx: str | None) -> "Body | None":
    """Offsets of Tx and Rx for `rislam-rt slam` from the options `--tx` and `--rx`; None without them."""
    import numpy as np

    from rislam_rt.model import Body

    if tx is None and rx is None:
        return None
    if tx is None or rx is None:
        raise ConfigError("--tx, --rx: one alone received; give both")
    ends = parse_point("--tx", tx), parse_point("--rx", rx)
    for option, end in zip(("--tx", "--rx"), ends, strict=True):
        if np.linalg.norm(end) > LONGEST_ARM:
            warn(f"{option}: {np.linalg.norm(end):.3g} m from the agent's position; give metres")
    return Body(*ends)


def _new_folder(folder: Path) -> Path:
    """Output folder of `rislam-rt slam`, which must not exist or be empty."""
    try:
        place = Path(os.path.realpath(folder))  # `x/..` is there though `x` is not
        taken = place.exists() and (not place.is_dir() or any(place.iterdir()))
    except OSError as error:
        raise ConfigError(f"--out {str(folder)[:80]}: cannot be used ({error.strerror}); give another folder") from None
    if taken:
        raise ConfigError(f"--out {folder}: exists and is not empty; give a new folder")
    check_writable(folder)
    return folder
