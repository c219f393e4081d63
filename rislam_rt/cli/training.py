"""Training of the component classifier on the command line: runs a pipeline file of kind `train_classifier`."""

import typer

from rislam_rt.cli.options import StudyOptions, write_json
from rislam_rt.cli.output_files import study_folder
from rislam_rt.cli.progress import show_progress
from rislam_rt.cli.scenes import open_scene
from rislam_rt.cli.study import refuse_scene
from rislam_rt.pipeline.run import prepare_channel
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.report.studies.classifier import (
    classifier_page,
    classifier_table,
    draw_importance,
    draw_panel,
    draw_scores,
    weights_file,
)
from rislam_rt.report.style import to_png
from rislam_rt.shipped import room_beside
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.classifier.run import ALL, train_and_score
from rislam_rt.studies.classifier.sets import gather_sets
from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.spec import study_record

PAGE, WEIGHTS = "classifier", "weights.npz"
PICTURES = {
    "figures/classifier_scores.png": draw_scores,
    "figures/classifier_features.png": draw_importance,
    "figures/classifier_panel.png": draw_panel,
}


def run_classifier(spec: ClassifierSpec, given: StudyOptions) -> None:
    """Train and score the classifier of multipath components, and write weights, page, data and figures."""
    refuse_scene(given, "train_classifier", "names its rooms; set 'rooms'")
    radio = build_radio(spec.radio)
    scenes = [open_scene(room_beside(given.pipeline.parent, room.scene), radio).scene for room in spec.rooms]
    record = study_record(spec, scenes)
    files = (f"{PAGE}.md", f"{PAGE}.json", WEIGHTS, *(PICTURES if given.page else ()))
    folder = study_folder(given.out, f"{spec.name}-{spec.seed}", record, files)
    prepare_channel(spec.channel)
    with show_progress() as progress:
        found = train_and_score(gather_sets(scenes, spec, progress=progress), spec)
    content = {**record, **classifier_table(found)}
    contents = {
        f"{PAGE}.md": classifier_page(found, spec, (*PICTURES,) if given.page else None).encode(),
        f"{PAGE}.json": json_file(content),
        WEIGHTS: weights_file(found),
    }
    if given.page:
        contents |= {name: to_png(draw(found)) for name, draw in PICTURES.items()}
    page = write_all(folder, contents)
    typer.echo(f"F1 on all test rooms: {found.scores[ALL]['network'].f1:.4f}")
    typer.echo(f"page: {page}")
    write_json(given.json, content)
