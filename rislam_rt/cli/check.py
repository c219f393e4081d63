"""The command `rislam-rt check SCENE`: checks a scene folder, and predicts which landmarks a run will detect."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rislam_rt.cli.options import MAIN_JOB, JsonFile, SceneFolder, Settings, pipeline_file
from rislam_rt.cli.output_files import OUTPUT, write_json
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import counted
from rislam_rt.shipped import is_shipped

if TYPE_CHECKING:
    from rislam_rt.adviser.link_budget import Survey
    from rislam_rt.model import Scene
    from rislam_rt.pipeline import PipelineSpec
    from rislam_rt.pipeline.specification.pipeline_spec import Settings as Records
    from rislam_rt.scene.findings import Finding

SEED = 0
"""Seed of the random phase codes under which the advice computes a panel's detectability."""


def command(
    scene: SceneFolder,
    carrier_ghz: Annotated[
        float | None,
        typer.Option(min=0.001, max=1000.0, help="Carrier, for that of the pipeline (10 GHz)."),
    ] = None,
    pipeline: Annotated[
        Path | None,
        typer.Option(metavar="PIPELINE", help="Whose radio and receiver the room is held against, and whose run has to "
                     f"fit it; without it, those of {MAIN_JOB}.", parser=pipeline_file, show_default=False),
    ] = None,
    set_: Settings = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw where the panel can be heard (PNG, SVG or PDF)."), OUTPUT
    ] = None,
    json: JsonFile = None,
) -> None:  # fmt: skip
    """Look for what is wrong with a scene, and say what a run in it will hear.

    Exit code 2 if it is unusable; warnings are allowed. What a run will hear depends on radio and receiver: those of
    the main job, of --pipeline, or as changed, as is how much of the way is looked at (`cycles`). What keeps that run
    from starting in this room is an error, too.

    Example: rislam-rt check myroom --set radio.reference_snr_db=0 --picture coverage.png
    """
    from dataclasses import asdict

    from rislam_rt.adviser.link_budget import survey
    from rislam_rt.adviser.return_warnings import return_warnings
    from rislam_rt.cli.run import names_schemes
    from rislam_rt.pipeline import load_spec
    from rislam_rt.pipeline.estimators import use_directions
    from rislam_rt.pipeline.room.array_warnings import array_warnings
    from rislam_rt.pipeline.room.late_paths import late_path_warnings
    from rislam_rt.pipeline.room.motion_warnings import motion_warnings, short_motion_warnings
    from rislam_rt.pipeline.run import cut_scene
    from rislam_rt.pipeline.specification.pipeline_spec import build_settings
    from rislam_rt.scene import check_scene
    from rislam_rt.scene.load import read_draft
    from rislam_rt.scene.scene_folder import scene_file

    changed = list(set_ or ())
    if carrier_ghz is not None:
        changed += [f"radio.carrier_ghz={carrier_ghz}", f"radio.bandwidth_ghz={min(1.0, carrier_ghz)}"]
    file = pipeline or pipeline_file(str(MAIN_JOB))
    told = f"pipeline '{file.stem}'" if is_shipped(file) else str(file)
    spec = load_spec(file, changed)
    settings = build_settings(spec)
    if picture is not None:
        from rislam_rt.report.style import picture_kind

        picture_kind(picture)  # before anything is worked out
    findings = check_scene(Path(scene), settings.radio)
    checked, looked = None, None
    if not any(finding.severity == "error" for finding in findings):
        checked = read_draft(Path(scene)).scene
    if checked is not None:
        places = str(scene_file(scene)), told
        findings += _run_errors(checked, spec, places, changed, named=names_schemes(spec, file, changed))
        checked = cut_scene(checked, spec.cycles)
        looked = survey(checked, settings)
        findings += motion_warnings(checked, settings.radio, settings.receiver, spec.budget, places[0])
        findings += short_motion_warnings(checked, spec.budget, places[0])
        if use_directions(spec.schemes):
            findings += array_warnings(settings.radio, _place("radio.array", told, changed))
        findings += late_path_warnings(looked.paths, looked.settings, places[0])
        findings += return_warnings(looked, places[0])
    for finding in findings:
        typer.echo(f"{finding.severity}: {finding.line}")
    errors, warnings = (sum(f.severity == severity for f in findings) for severity in ("error", "warning"))
    content = {"scene": str(scene), "errors": errors, "findings": [asdict(finding) for finding in findings]}
    if checked is not None and looked is not None:
        content["advice"] = _advise(checked, settings, picture, looked)
    write_json(json, content)
    typer.echo(f"{scene}: {counted(errors, 'error')}, {counted(warnings, 'warning')}")
    if errors:
        raise typer.Exit(2)


def _run_errors(
    scene: "Scene", spec: "PipelineSpec", files: tuple[str, str], changed: Sequence[str], *, named: bool
) -> "list[Finding]":
    """Part of `rislam-rt check`: the error that `rislam-rt run` would end with at once, of a pipeline that does not fit
    a scene. Its place is one of the `files` of scene and pipeline, or `--set` for what is `changed` there; `named`:
    whether the user named the schemes."""
    from rislam_rt.cli.run import panel_schemes, without_schemes
    from rislam_rt.pipeline.run import check_run
    from rislam_rt.scene.findings import error_at

    try:
        check_run(scene, spec if named else without_schemes(spec, panel_schemes(spec, scene)))
    except ConfigError as error:
        field, _, told = str(error).partition(": ")
        message, _, mend = told.partition("; ")
        place = _place(field, files[0] if field.startswith("ris.") else files[1], changed)
        return [error_at(place, field, message, mend)]
    return []


def _place(field: str, file: str, changed: Sequence[str]) -> str:
    """Part of `rislam-rt check`: where a setting comes from, `--set` if it or one below it was `changed`, or a file."""
    keys = [setting.partition("=")[0].strip() for setting in changed]
    return "--set" if any(f"{key}.".startswith(f"{field}.") for key in keys) else file


def _advise(scene: "Scene", settings: "Records", picture: Path | None, looked: "Survey") -> dict[str, object]:
    """Part of `rislam-rt check`: print which landmarks will be detected, as the survey has it, draw the coverage if
    asked, return the advice."""
    import numpy as np

    from rislam_rt.adviser.advice import advise
    from rislam_rt.adviser.coverage import panel_coverage
    from rislam_rt.report.advice import draw_coverage, print_advice

    advice = advise(scene, settings, rng=np.random.default_rng(SEED), looked=looked)
    print_advice(advice)
    if picture is not None:
        coverages = panel_coverage(scene, settings)
        said = draw_coverage(scene, coverages, picture) if coverages else "none: the scene has no panel"
        typer.echo(f"picture: {said}")
    return advice.as_dict()
