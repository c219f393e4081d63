"""The command `rislam-rt config [PIPELINE]`: prints all settings of a pipeline with units, ranges and meanings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rislam_rt.cli.options import MAIN_JOB, JsonFile, PipelineFile, Settings
from rislam_rt.cli.output_files import write_json
from rislam_rt.shipped import name_from_here, room_beside
from rislam_rt.toml import toml_value

if TYPE_CHECKING:
    from rislam_rt.pipeline.specification.settings_list import Setting


def command(
    pipeline: PipelineFile = MAIN_JOB,
    set_: Settings = None,
    explain: Annotated[str | None, typer.Option(metavar="KEY", help="Say all about one setting, or a table.")] = None,
    json: JsonFile = None,
) -> None:
    """Print every setting of a pipeline: value, unit, range, and what it means.

    What is printed is a pipeline file itself: `rislam-rt config > mine.toml`, edit, `rislam-rt run mine.toml`.

    Example: rislam-rt config trace_then_slam --explain slam.sigma_a
    """
    from rislam_rt.pipeline.specification.settings_list import explain as find
    from rislam_rt.pipeline.specification.settings_list import list_settings
    from rislam_rt.studies import load_any

    spec = load_any(pipeline, set_ or ())
    settings = list_settings(type(spec))
    if explain is not None:
        settings = find(settings, explain)
        for number, one in enumerate(settings):
            if number:
                typer.echo()
            _print_one(one, _value(spec, one.key))
    else:
        _print_file(settings, spec, pipeline.parent)
    write_json(json, {one.key: one._asdict() | {"value": _plain(_value(spec, one.key))} for one in settings})


def _print_file(settings: "list[Setting]", spec: Any, folder: Path) -> None:
    """Print all settings of `config` as TOML, each under one line on its meaning; those without a value as comments.
    Rooms are named as a file in the working folder names them, for that is where the output is put."""
    table = ""
    for one in settings:
        head, _, name = one.key.rpartition(".")
        if head != table:
            typer.echo(f"\n[{head}]")
            table = head
        value = _from_here(_plain(_value(spec, one.key)), folder, one.key)
        typer.echo(f"# {_facts(one)}")
        typer.echo(f"# {name} =" if value is None else f"{name} = {toml_value(value)}")


def _print_one(one: "Setting", value: Any) -> None:
    """Print value, meaning, range and default of one setting."""
    typer.echo(f"{one.key} = {'(not set)' if value is None else toml_value(_plain(value))}")
    typer.echo(_facts(one))
    if not one.required:
        typer.echo(f"Default: {'not set' if one.default is None else toml_value(_plain(one.default))}.")


def _facts(one: "Setting") -> str:
    """Meaning, type, unit and range of a setting in one line."""
    facts = [one.kind, f"in {one.unit}" if one.unit else "", one.allowed]
    return f"{one.meaning} ({'; '.join(fact for fact in facts if fact)})".strip()


def _value(spec: Any, key: str) -> Any:
    """Value of the setting with a dotted key in a specification, for `rislam-rt config`."""
    for part in key.split("."):
        spec = getattr(spec, part)
    return spec


def _from_here(value: Any, folder: Path, key: str = "") -> Any:
    """A value for `config`, with the scene folders in it, which are relative to `folder`, as seen from here."""
    if isinstance(value, list):
        return [_from_here(item, folder, key) for item in value]
    if isinstance(value, dict):
        return {name: _from_here(item, folder, name) for name, item in value.items()}
    named = key in ("scene", "scenes") and isinstance(value, str)
    return name_from_here(room_beside(folder, value)) if named else value


def _plain(value: Any) -> Any:
    """Value of a setting as plain data for TOML and JSON, for `rislam-rt config`."""
    from pydantic import BaseModel

    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", exclude_none=True)
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
