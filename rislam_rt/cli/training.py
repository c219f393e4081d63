"""What `rislam-rt run` does with a pipeline that trains the classifier."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rislam_rt.cli.options import write_json
from rislam_rt.cli.output_files import study_folder

if TYPE_CHECKING:
    from rislam_rt.cli.study import StudyOptions
    from rislam_rt.studies.classifier.spec import ClassifierSpec

PAGE, SCORES, IMPORTANCE = "classifier", "figures/classifier_scores.png", "figures/classifier_features.png"
PANEL, WEIGHTS = "figures/classifier_panel.png", "weights.npz"


def run_classifier(spec: "ClassifierSpec", given: "StudyOptions") -> None:
    """Train the classifier of components and score it; weights, page, data and figures."""
    from rislam_rt.cli.progress import show_progress
    from rislam_rt.cli.scenes import open_scene
    from rislam_rt.errors import ConfigError
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
    from rislam_rt.storage.files import write_atomic
    from rislam_rt.studies.classifier.run import ALL, run_training
    from rislam_rt.studies.spec import study_record

    if given.scene is not None:
        raise ConfigError(f"--scene {given.scene}: a pipeline of kind 'train_classifier' names its rooms; set 'rooms'")
    radio, beside = build_radio(spec.radio), given.pipeline.parent
    scenes = [open_scene(Path(os.path.normpath(beside / room.scene)), radio).scene for room in spec.rooms]
    record = study_record(spec, scenes)
    files = (f"{PAGE}.md", f"{PAGE}.json", WEIGHTS, *((SCORES, IMPORTANCE, PANEL) if given.page else ()))
    folder = study_folder(given.out, f"{spec.name}-{spec.seed}", record, files)
    prepare_channel(spec.channel)
    with show_progress() as progress:
        found = run_training(scenes, spec, progress=progress)
    content = {**record, **classifier_table(found)}
    contents = {
        f"{PAGE}.md": classifier_page(found, spec, (SCORES, IMPORTANCE, PANEL) if given.page else None).encode(),
        f"{PAGE}.json": (json.dumps(content, indent=1, allow_nan=False) + "\n").encode(),
        WEIGHTS: weights_file(found),
    }
    if given.page:
        contents |= {SCORES: to_png(draw_scores(found)), IMPORTANCE: to_png(draw_importance(found))}
        contents |= {PANEL: to_png(draw_panel(found))}
    for name, data in contents.items():
        write_atomic(folder / name, data)
    typer.echo(f"F1 on all test rooms: {found.scores[ALL]['network'].f1:.4f}")
    typer.echo(f"page: {folder / PAGE}.md")
    write_json(given.json, content)
