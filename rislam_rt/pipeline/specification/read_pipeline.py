"""Read a pipeline file, with settings of the command line put over it, and check its keys and values."""

import os
from collections.abc import Callable, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from rislam_rt.errors import ConfigError, expect
from rislam_rt.input_messages import did_you_mean, expected_input, nearest
from rislam_rt.model import RadioConfig
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.radio import RadioSection, build_radio
from rislam_rt.pipeline.specification.section import Section
from rislam_rt.shipped import beside_of, find_pipeline, shipped_missing, shipped_pipelines
from rislam_rt.toml import MAX_LEVELS, parse_toml, parse_value

MAX_BYTES = 1_000_000
"""Largest size [bytes] of a pipeline file; anything larger is another file by mistake."""

EITHER = (("radio", "reference_snr_db", "noise_psd"),)
"""Tables of a pipeline file with the keys that exclude each other."""

Spec = TypeVar("Spec", bound=BaseModel)


class Table(NamedTuple):
    """Content of a pipeline file with the command line's settings put over it, not yet checked."""

    path: Path
    content: dict[str, Any]
    changed: tuple[str, ...]
    """Keys that the command line set, dotted."""
    sweep: dict[str, Any] | None = None
    """The table `[sweep]`, which is no part of the experiment itself."""


def load_spec(path: str | Path, overrides: Sequence[str] = ()) -> PipelineSpec:
    """Read a pipeline file as a checked specification, with `key=value` settings (dotted keys) put over it first.

    Where there is no file of that path, it is the pipeline of that name that comes with the package
    (`load_spec("trace_then_slam")`), as on the command line.

    Raises
    ------
    ConfigError
        The file cannot be read or is not TOML; a key is unknown, a value of the wrong type or out of range. One line.
    """
    return build_spec(read_table(path, overrides), PipelineSpec, build_settings)


class RadioSpec(Section):
    """Settings of commands that need the radio alone of a pipeline."""

    radio: RadioSection = RadioSection()


def load_radio(overrides: Sequence[str]) -> RadioConfig:
    """Default radio configuration, with `radio.key=value` settings of the command line put over it.

    Raises
    ------
    ConfigError
        A key is unknown, a value of the wrong type or out of range. One line.
    """
    if not overrides:
        return RadioConfig()
    return build_radio(build_spec(settings_table(overrides, {}), RadioSpec, lambda spec: build_radio(spec.radio)).radio)


def read_table(path: str | Path, overrides: Sequence[str] = ()) -> Table:
    """Read a pipeline file of any kind as an unchecked table, with `key=value` settings (dotted keys) put over it.

    A scene that a setting names is as seen from the working folder, one that the file names as seen from its folder.

    Raises
    ------
    ConfigError
        The file cannot be read or is not TOML; a setting has no such form.
    """
    expect("path", path, (str, os.PathLike))
    if isinstance(overrides, str) or not isinstance(overrides, Sequence):
        what = repr(overrides[:60]) if isinstance(overrides, str) else type(overrides).__name__
        raise ConfigError(f"overrides: {what} received; give a list of settings, e.g. ['radio.bandwidth_ghz=0.5']")
    path = find_pipeline(path)
    content = _read_toml(path)
    changed = tuple(_override(content, setting, path.parent) for setting in overrides)
    table = Table(path, content, changed, content.pop("sweep", None))
    make_way(table, changed)
    return table


def make_way(table: Table, keys: Sequence[str]) -> None:
    """Remove from a pipeline's table the keys that exclude one of `keys` (dotted), which are set over the file.

    A key that the command line set is kept, so that the contradiction is reported.
    """
    for section, *names in EITHER:
        if any(f"{section}.{name}" in keys for name in names):
            for name in names:
                if f"{section}.{name}" not in (*keys, *table.changed) and section in table.content:
                    table.content[section].pop(name, None)


def settings_table(overrides: Sequence[str], defaults: dict[str, Any]) -> Table:
    """Unchecked table of `key=value` settings (dotted keys) of the command line, put over defaults, without a file.

    Raises
    ------
    ConfigError
        A setting has no such form.
    """
    content = deepcopy(defaults)
    return Table(Path("--set"), content, tuple(_override(content, setting) for setting in overrides))


def build_spec(table: Table, model: type[Spec], check: Callable[[Spec], object]) -> Spec:
    """Check a pipeline's table against its typed model and return the specification.

    `check` builds the settings in SI units, to find values out of range; its errors begin with the field.

    Raises
    ------
    ConfigError
        A key is unknown, a value of the wrong type or out of range. A line for each that names file and field.
    """
    path, content, changed = table.path, table.content, table.changed
    try:
        spec = model.model_validate(content)
    except ValidationError as error:
        items = error.errors(include_url=False, include_context=False)
        items = [item for item in items if item["loc"] == ("kind",)] or items  # a file of another kind has other keys
        items = [item for item in items if item["type"] == "missing" or _is_said(content, item["loc"])] or items
        raise ConfigError(*(_line(path, item, changed, model) for item in items)) from None
    try:
        check(spec)
    except ConfigError as error:
        raise ConfigError(f"{_source(path, str(error).partition(':')[0], changed)}: {error}") from None
    return spec


def _read_toml(path: Path) -> dict[str, Any]:
    """Content of a pipeline file in TOML."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        known = shipped_pipelines()
        mend = did_you_mean(nearest(path.stem, known)) or f"give one, or a built-in one: {', '.join(known)}"
        raise ConfigError(f"{path}: no such pipeline file; {mend if known else shipped_missing('pipelines')}") from None
    except OSError as error:
        mend = "give a pipeline file in TOML"
        if (path / "scene.toml").is_file():
            mend = f"give a pipeline, and the scene with it: trace_then_slam --scene {path}"
        elif (path / "config.toml").is_file():
            mend = f"give {path / 'config.toml'}"
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); {mend}") from None
    if len(content) > MAX_BYTES:
        raise ConfigError(f"{path}: more than {MAX_BYTES} bytes; give a pipeline file in TOML")
    try:
        table = parse_toml(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not text in UTF-8 (byte {error.start}); save it as UTF-8") from None
    except ValueError as error:
        cause = " ".join(str(error).split())[:120]
        raise ConfigError(f"{path}: not valid TOML ({cause}); mend that place") from None
    if "reflector" in table:
        raise ConfigError(f"{path}: is a scene file, not a pipeline; give trace_then_slam --scene {path.parent}")
    return table


def _override(table: dict[str, Any], setting: str, folder: Path = Path()) -> str:
    """Put one `--set key=value` into the table of a pipeline file in a folder; returns the key."""
    key, equals, text = setting.partition("=")
    parts = key.strip().split(".")
    if not equals or len(parts) > MAX_LEVELS or not all(part.isidentifier() for part in parts):
        raise ConfigError(f"--set {setting[:80]!r}: not of the form key=value; give e.g. --set radio.bandwidth_ghz=0.5")
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ConfigError(f"--set {setting[:80]!r}: '{part}' is not a section; mend the key")
    table[parts[-1]] = beside_of(folder, parse_value(text.strip()), parts[-1])
    return ".".join(parts)


def _source(path: Path, place: str, changed: Sequence[str], unknown: bool = False) -> str:
    """Origin of a pipeline's setting at fault, for messages: `--set` if the command line gave it or a key in it, else
    the file."""
    places = place.split(", ")  # one complaint may be of several
    set_there = any(f"{one}.".startswith((f"{key}.", f"{key}[")) for key in changed for one in places)
    return "--set" if set_there or (unknown and any(key.startswith(f"{place}.") for key in changed)) else str(path)


def _place(item: Any) -> str:
    """Dotted key of a validation error in a pipeline file."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in item["loc"]).lstrip(".")[:100]


def _line(path: Path, item: Any, changed: Sequence[str], model: type[BaseModel]) -> str:
    """Line for one validation error of a pipeline: the file, or the command line that set the key, and the message."""
    said = str(item["msg"]).removeprefix("Value error, ").partition(":")[0]  # of a whole table, it begins with the key
    source = _source(path, _place(item) or said, changed, item["type"] == "extra_forbidden")
    return f"{source}: {_remark(item, model, source == '--set')}"


def _remark(item: Any, model: type[BaseModel], typed: bool) -> str:
    """Message for one validation error as a pipeline file is read: key, value received, how to mend it."""
    place = _place(item)
    if item["type"] == "missing":
        return f"{place}: missing; add it"
    if item["type"] == "extra_forbidden":
        near = _near_key([str(part) for part in item["loc"]], model)
        return f"{place}: unknown key; {did_you_mean(near) or 'remove it or mend its name'}"
    if isinstance(item["input"], dict):
        message = " ".join(str(item["msg"]).removeprefix("Value error, ").split())
        return f"{place}: {message}" if place else message
    return f"{place}: {str(item['input'])[:60]!r} received; {expected_input(item, typed)}"


def _is_said(content: Any, place: tuple[Any, ...]) -> bool:
    """Whether a pipeline's table itself gives the key at fault, which else was copied from another table."""
    for part in place:
        if not isinstance(content, dict):
            return True  # of a list or a value, all is said
        if part not in content:
            return False
        content = content[part]
    return True


def _near_key(words: list[str], model: type[BaseModel]) -> list[str]:
    """Known keys like an unknown one of a pipeline file: the same name in another table, or else one of its table."""
    keys = _keys(model)
    table = ".".join(word for word in words[:-1] if not word.isdigit())
    own = [key.rpartition(".")[2] for key in keys if key.rpartition(".")[0] == table]
    names = {key.rpartition(".")[2]: key for key in reversed(keys)}  # of several tables the first
    return [names[words[-1]]] if words[-1] in names else nearest(words[-1], own)


def _keys(section: type[BaseModel], above: str = "") -> list[str]:
    """All keys of a table of a pipeline file and of the tables below it, dotted."""
    keys = []
    for name, field in section.model_fields.items():
        keys.append(f"{above}{name}")
        for part in (field.annotation, *get_args(field.annotation)):
            if isinstance(part, type) and issubclass(part, BaseModel):
                keys += _keys(part, f"{above}{name}.")
    return keys
