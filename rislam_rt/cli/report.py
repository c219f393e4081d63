"""The command `rislam-rt report RUN`: scores a completed run again, draws its page, exports a GIF or Rerun file."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import JsonFile, RunFolder
from rislam_rt.cli.output_files import OUTPUT, write_json
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.cli.run import show_scores
from rislam_rt.errors import ConfigError
from rislam_rt.storage.files import write_atomic


def command(
    run: RunFolder,
    rerun: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a recording for the Rerun viewer (.rrd); needs the extra `viz`."),
        OUTPUT,
    ] = None,
    gif: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a moving picture of the run (.gif)."), OUTPUT
    ] = None,
    json: JsonFile = None,
) -> None:
    """Score a completed run again and draw its figures and page, which holds a map with a slider over the time.

    Example: rislam-rt report runs/demo-paper_room-7-0123abcd --rerun demo.rrd
    """
    from rislam_rt.pipeline.long.run import read_any
    from rislam_rt.pipeline.store.run_folder import hold_run
    from rislam_rt.report import write_report

    if gif is not None and gif.suffix.lower() != ".gif":
        raise ConfigError(f"--gif: '{gif}' received; give a name that ends in .gif")
    summary, result = read_any(run)
    if rerun is not None:
        from rislam_rt.report.exports.rerun_recording import recording_bytes

        write_atomic(rerun, recording_bytes(result, run.resolve().name))
        typer.echo(f"recording: {rerun}")
    if gif is not None:
        from rislam_rt.report.exports.animation import gif_bytes

        with show_progress() as tell:
            write_atomic(gif, gif_bytes(result, tell))
        typer.echo(f"moving picture: {gif}")
    show_scores(summary)
    with hold_run(run):
        page = write_report(result, summary, run)
    typer.echo(f"report: {page}")
    write_json(json, summary)
