"""`rislam-rt report RUN`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import JsonFile, write_json


def command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a completed run.", show_default=False)],
    rerun: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a recording for the Rerun viewer (.rrd); needs the extra `viz`."),
    ] = None,
    json: JsonFile = None,
) -> None:
    """Score a completed run again and draw its figures and page.

    Example: rislam-rt report runs/demo-paper_room-7-0123abcd --rerun demo.rrd
    """
    from rislam_rt.pipeline.long import read_any
    from rislam_rt.pipeline.store import hold_run
    from rislam_rt.report import write_report
    from rislam_rt.report.tables import print_summary

    summary, result = read_any(run)
    if rerun is not None:
        from rislam_rt.pipeline.files import write_atomic
        from rislam_rt.report.recording import recording_bytes

        write_atomic(rerun, recording_bytes(result, run.resolve().name))
        typer.echo(f"recording: {rerun}")
    print_summary(summary)
    with hold_run(run):
        page = write_report(result, summary, run)
    typer.echo(f"report: {page}")
    write_json(json, summary)
