"""`rislam-rt check SCENE`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import JsonFile, SceneFolder, write_json


def command(
    scene: SceneFolder,
    carrier_ghz: Annotated[
        float, typer.Option(min=0.001, max=1000.0, help="Carrier that materials and panel are held against.")
    ] = 10.0,
    json: JsonFile = None,
) -> None:
    """Look for what is wrong with a scene. Exit code 2 if it is unusable; warnings are allowed."""
    from rislam_rt.model import RadioConfig
    from rislam_rt.scene import check_scene

    findings = check_scene(Path(scene), RadioConfig(carrier=1e9 * carrier_ghz, bandwidth=min(1e9, 1e9 * carrier_ghz)))
    for finding in findings:
        typer.echo(f"{finding.severity}: {finding.line}")
    errors, warnings = (sum(f.severity == severity for f in findings) for severity in ("error", "warning"))
    fields = ("severity", "file", "field", "message", "mend")
    write_json(
        json,
        {
            "scene": str(scene),
            "errors": errors,
            "findings": [{name: getattr(finding, name) for name in fields} for finding in findings],
        },
    )
    typer.echo(f"{scene}: {errors} errors, {warnings} warnings")
    if errors:
        raise typer.Exit(2)
