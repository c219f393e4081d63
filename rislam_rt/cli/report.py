"""`rislam-rt report RUN`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import JsonFile, write_json


def command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a completed run.", show_default=False)],
    json: JsonFile = None,
) -> None:
    """Score a completed run again and draw its figures and page."""
    from rislam_rt.pipeline.long import read_any
    from rislam_rt.pipeline.store import hold_run
    from rislam_rt.report import write_report
    from rislam_rt.report.tables import print_summary

    summary, result = read_any(run)
    print_summary(summary)
    with hold_run(run):
        page = write_report(result, summary, run)
    typer.echo(f"report: {page}")
    write_json(json, summary)
