"""The study in unseen rooms on the command line: runs a pipeline file of kind `unseen` for `rislam-rt run`."""

from collections.abc import Sequence
from pathlib import Path

from rislam_rt.cli.options import StudyOptions
from rislam_rt.cli.output_files import page_files, study_folder
from rislam_rt.cli.study import refuse_scene, run_cells
from rislam_rt.pipeline.run import prepare_channel
from rislam_rt.report.terminal_tables import print_cards
from rislam_rt.report.unseen import write_unseen
from rislam_rt.studies import UnseenSpec
from rislam_rt.studies.unseen import build_unseen, count_tests
from rislam_rt.studies.unseen.sweep import unseen_record
from rislam_rt.sweeps import Row, build_cells
from rislam_rt.sweeps.store import check_folder, read_timings


def run_unseen(spec: UnseenSpec, given: StudyOptions) -> None:
    """Run the study in unseen random rooms, print the scores and write its page; exit code 1 if a room failed."""
    refuse_scene(given, "unseen", "draws its rooms; leave it out")
    cells = Path("sweeps") / spec.name
    record = unseen_record(spec)
    files = page_files(spec.name, figure=given.page)
    folder = study_folder(given.out, f"{spec.name}-{spec.first}", record, files)
    check_folder(cells)
    sweep = build_unseen(spec, given.pipeline, Path("sweeps") / f"{spec.name}_data")
    for kind in {cell.depends["config"]["channel"] for cell in build_cells(sweep)}:
        prepare_channel(kind)
    tests = count_tests(spec, given.pipeline)

    def write(rows: Sequence[Row]) -> Path | None:
        timings = read_timings(cells)
        return write_unseen(rows, spec, record, folder, tests=tests, timings=timings, figures=given.page)

    def show(rows: Sequence[Row]) -> None:
        print_cards(rows, read_timings(cells))

    run_cells(sweep, cells, spec.time_limit_s, given, record, write, show)
