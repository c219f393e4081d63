"""Studies on the command line: runs a pipeline file of a kind other than `slam` for `rislam-rt run`."""

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import typer

from rislam_rt.cli.interrupts import Interrupted
from rislam_rt.cli.options import StudyOptions
from rislam_rt.cli.output_files import page_files, study_folder, write_json
from rislam_rt.cli.progress_bars import show_progress, show_sweep
from rislam_rt.cli.scene_arguments import open_scene, scene_of
from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.report.studies import classifier
from rislam_rt.report.studies.channel_validation import CERTIFICATE, COMPARISON, write_comparison
from rislam_rt.report.studies.claims import write_claims
from rislam_rt.report.studies.fig4a import CURVES, fig4a_table, findings_of, write_fig4a
from rislam_rt.report.style import to_png
from rislam_rt.report.swept import write_swept
from rislam_rt.report.terminal_tables import print_cards, print_validation
from rislam_rt.report.unseen import write_unseen
from rislam_rt.scene.scene_folder import safe_name
from rislam_rt.shipped import room_beside
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies import ClaimsSpec, CompareSpec, Fig4aSpec, SweptSpec, UnseenSpec
from rislam_rt.studies.channel_validation import comparison_table, run_comparison
from rislam_rt.studies.claims import SOURCE, judge, read_results
from rislam_rt.studies.classifier.sets import gather_sets
from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.classifier.train import ALL, train_and_score
from rislam_rt.studies.fig4a import check_fig4a, run_fig4a
from rislam_rt.studies.spec import distinct_scenes, study_record
from rislam_rt.studies.swept import build_sweep
from rislam_rt.studies.swept.sweep import swept_record
from rislam_rt.studies.unseen import build_unseen, count_tests
from rislam_rt.studies.unseen.sweep import unseen_record
from rislam_rt.sweeps import Row, Sweep, SweepOptions, build_cells, run_sweep
from rislam_rt.sweeps.store import check_folder, read_timings


def _refuse_scene(given: StudyOptions, kind: str, why: str) -> None:
    """Raise an error if `rislam-rt run` gets `--scene` for a study that names its own rooms, or has none."""
    if given.scene is not None:
        raise ConfigError(f"--scene {given.scene}: a pipeline of kind '{kind}' {why}")


def run_compare_channels(spec: CompareSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of a study: compare both channels, and write the page; exit code 1 if they differ."""
    _refuse_scene(given, "compare_channels", "names its rooms; set 'rooms'")
    radio = build_radio(spec.radio)
    opened = [open_scene(room_beside(given.pipeline.parent, room.scene), radio) for room in spec.rooms]
    scenes = distinct_scenes([one.scene for one in opened])
    record = study_record(spec, scenes)
    files = (f"{COMPARISON}.md", f"{COMPARISON}.json", *([CERTIFICATE] if given.page else []))
    folder = study_folder(given.out, f"{spec.name}-{spec.seed}", record, files)
    prepare_channel("traced")
    for one in opened:
        one.warn()
    with show_progress() as progress:
        found = run_comparison(scenes, spec, jobs=given.jobs or os.cpu_count() or 1, progress=progress)
    counts = {"passed": found.passed, "unexplained": found.unexplained, "breaches": found.breaches}
    content = {**record, **counts, "rooms": comparison_table(found)}
    print_validation(found.rows)
    typer.echo(f"page: {write_comparison(found, spec, content, folder, figures=given.page)}")
    write_json(given.json, content)
    if not found.passed:
        raise typer.Exit(1)


def run_gain_curves(spec: Fig4aSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of a study: compute Fig. 4(a), panel gain against distance, and write its page."""
    opened = open_scene(scene_of(given.scene, spec, given.pipeline), build_radio(spec.radio))
    scene = opened.scene
    check_fig4a(scene, spec)
    record = study_record(spec, [scene])
    files = page_files(CURVES, figure=given.page)
    folder = study_folder(given.out, f"{spec.name}-{safe_name(scene.name)}-{spec.seed}", record, files)
    prepare_channel(spec.channel)
    opened.warn()
    with show_progress() as progress:
        found = run_fig4a(scene, spec, rng=np.random.default_rng(spec.seed), progress=progress)
    content = {**record, **fig4a_table(found)}
    for element in found.curves:
        typer.echo("\n".join([*findings_of(found, element), ""]))
    typer.echo(f"page: {write_fig4a(found, spec, scene.name, content, folder, figures=given.page)}")
    write_json(given.json, content)


def run_swept(spec: SweptSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of a swept study (rooms, ablations, ...): write its page; exit code 1 if a cell failed."""
    sweep = build_sweep(spec, given.pipeline, given.scene)
    found = build_cells(sweep)
    record, cells = swept_record(spec, sweep, given.pipeline), Path("sweeps") / spec.name
    files = page_files(spec.name, figure=given.page)
    folder = study_folder(given.out, f"{spec.name}-{spec.seed}", record, files)
    check_folder(cells)
    for kind in {cell.depends["config"]["channel"] for cell in found}:
        prepare_channel(kind)

    write = partial(write_swept, spec=spec, record=record, folder=folder, figures=given.page)
    run_cells(sweep, cells, spec.time_limit_s, given, record, write)


def run_cells(
    sweep: Sweep, cells: Path, limit: float | None, given: StudyOptions, record: Mapping[str, Any],
    write: Callable[[Sequence[Row]], Path | None], show: Callable[[Sequence[Row]], None] | None = None,
) -> None:  # fmt: skip
    """For `rislam-rt run` of a study: its cells; page and `show` as they end; exit code 1 if one failed."""
    effort = SweepOptions(given.jobs or os.cpu_count() or 1, None, limit)
    try:
        with show_sweep() as tell:
            report = run_sweep(sweep, cells, effort, tell=tell, grow=write)
    except KeyboardInterrupt:
        raise Interrupted("interrupted: what is done is kept; the same command goes on from there") from None
    if show is not None:
        show(report.rows)
    typer.echo(f"page: {write(report.rows)}")
    typer.echo(f"cells: {cells}")
    write_json(given.json, {**record, "failed": len(report.failed)})
    if report.failed:
        raise typer.Exit(1)


def run_claims(spec: ClaimsSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of a study: check the paper's claims against the results of others, and write the page."""
    _refuse_scene(given, "claims", "runs in no room; leave it out")
    results = read_results(Path(os.path.normpath(given.pipeline.parent / spec.results)))
    found = judge(results)
    sources = {study: {name: content[name] for name in SOURCE} for study, content in results.items()}
    folder = study_folder(given.out, spec.name, results, page_files(spec.name))
    for claim in found:
        typer.echo(f"{claim.verdict}: {claim.claim}")
    typer.echo(f"page: {write_claims(found, spec.name, sources, folder)}")
    write_json(given.json, {"claims": [claim._asdict() for claim in found]})


def run_unseen(spec: UnseenSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of the study in unseen rooms: print scores, write its page; exit code 1 if a room failed."""
    _refuse_scene(
        given,
        "unseen",
        "draws its rooms; leave it out (a run in a room of one's own has the same card by rislam-rt score)",
    )
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

    run_cells(
        sweep, cells, spec.time_limit_s, given, record, write, lambda rows: print_cards(rows, read_timings(cells))
    )


PAGE, WEIGHTS = "classifier", "weights.npz"
PICTURES = {
    "figures/classifier_scores.png": classifier.draw_scores,
    "figures/classifier_features.png": classifier.draw_importance,
    "figures/classifier_panel.png": classifier.draw_panel,
}


def run_classifier(spec: ClassifierSpec, given: StudyOptions) -> None:
    """For `rislam-rt run` of a study: train and score the classifier, and write weights, page, data and figures."""
    _refuse_scene(given, "train_classifier", "names its rooms; set 'rooms'")
    radio = build_radio(spec.radio)
    opened = [open_scene(room_beside(given.pipeline.parent, room.scene), radio) for room in spec.rooms]
    scenes = distinct_scenes([one.scene for one in opened])
    record = study_record(spec, scenes)
    files = (f"{PAGE}.md", f"{PAGE}.json", WEIGHTS, *(PICTURES if given.page else ()))
    folder = study_folder(given.out, f"{spec.name}-{spec.seed}", record, files)
    prepare_channel(spec.channel)
    for one in opened:
        one.warn()
    with show_progress() as progress:
        found = train_and_score(gather_sets(scenes, spec, progress=progress), spec)
    content = {**record, **classifier.classifier_table(found)}
    contents = {
        f"{PAGE}.md": classifier.classifier_page(found, spec, (*PICTURES,) if given.page else None).encode(),
        f"{PAGE}.json": json_file(content),
        WEIGHTS: classifier.weights_file(found),
    }
    if given.page:
        contents |= {name: to_png(draw(found)) for name, draw in PICTURES.items()}
    page = write_all(folder, contents)
    typer.echo(f"F1 on all test rooms: {found.scores[ALL]['network'].f1:.4f}")
    typer.echo(f"page: {page}")
    write_json(given.json, content)
