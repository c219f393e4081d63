"""Reading of a scene file: TOML, validated by the schema; what is wrong in it is said field by field."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rislam_rt.input_messages import counted, did_you_mean, expected_input, nearest
from rislam_rt.scene.findings import Fault, Faults, one_line
from rislam_rt.scene.schema import (
    AgentSection,
    LimitsSection,
    MaterialSection,
    MeshesSection,
    OccluderSection,
    ReflectorSection,
    RisSection,
    ScattererSection,
    SceneSection,
    SceneSpec,
    WalkSection,
)
from rislam_rt.shipped import shipped_missing, shipped_rooms
from rislam_rt.toml import parse_toml

MAX_SCENE_BYTES = 4_000_000
"""Most bytes of a scene file, which people write; anything larger is another file by mistake."""
SECTIONS: dict[str, type[SceneSection]] = {
    "the top of the file": SceneSpec, "[[reflector]]": ReflectorSection, "material": MaterialSection,
    "[[scatterer]]": ScattererSection, "[[shade]]": OccluderSection, "[meshes]": MeshesSection, "[ris]": RisSection,
    "[agent]": AgentSection, "random_walk": WalkSection, "[limits]": LimitsSection,
}  # fmt: skip
"""Tables of the scene file, as messages name them."""


def parse_spec(content: bytes) -> SceneSpec:
    """Parse and validate the content of a scene file.

    Raises
    ------
    Fault
        Not TOML, or fields are missing, unknown or out of range; all of them in one line.
    """
    if len(content) > MAX_SCENE_BYTES:
        raise Fault(f"{len(content)} bytes are too many for a scene file", f"keep it below {MAX_SCENE_BYTES}")
    try:
        table = parse_toml(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise Fault(f"not text in UTF-8 (byte {error.start})", "save it as UTF-8") from None
    except ValueError as error:
        raise Fault(f"not valid TOML: {_short(str(error), 120)}", "mend that place") from None
    if "scene" in table and "reflector" not in table:
        raise Fault("is a pipeline, not a scene", "give the scene folder that it names")
    return validate_spec(table)


def validate_spec(table: dict[str, Any]) -> SceneSpec:
    """Validate the table of a scene file that was already read against the schema.

    Raises
    ------
    Faults
        Fields are missing, unknown or out of range: one fault a field.
    """
    try:
        return SceneSpec.model_validate(table)
    except ValidationError as error:
        lone = isinstance(table.get("ris"), dict)
        faults = [_fault(item, lone) for item in error.errors(include_url=False, include_context=False)]
    raise Faults(faults)


def read_spec(path: Path) -> tuple[SceneSpec, bytes]:
    """Validate a scene file by the schema: returns its specification and the bytes that were read.

    Raises
    ------
    Fault, Faults
        The file cannot be read or its content is not a scene.
    """
    if not path.is_file():
        known = {*shipped_rooms(), *(one.name for one in path.parent.parent.glob("*"))} - {path.parent.name}
        hint = did_you_mean(nearest(path.parent.name, sorted(known)))
        wanted = f"{hint} give a scene folder, its scene.toml, or the name of a built-in room".lstrip()
        raise Fault("no such scene file", "; ".join(filter(None, [wanted, shipped_missing("scenes")])))
    try:
        with path.open("rb") as file:
            content = file.read(MAX_SCENE_BYTES + 1)
    except OSError as error:
        raise Fault(f"cannot be read ({error.strerror})", "check the file and its permissions") from None
    return parse_spec(content), content


def _fault(item: Any, lone_panel: bool) -> Fault:
    """Fault of one bad field of a scene file: where, what was received, what is wanted."""
    where = item["loc"]
    if lone_panel and where[:2] == ("ris", 0):  # the file has `[ris]`
        where = ("ris", *where[2:])
    dotted = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where)
    place = _short(dotted.lstrip("."), 80)
    if item["type"] == "missing":
        return Fault(f"{place}: missing", "add it")
    if item["type"] == "extra_forbidden":
        return Fault(f"{place}: unknown key", _near_key(str(where[-1])) or "remove it or mend its name")
    if item["type"] == "list_type" and isinstance(item["input"], dict) and len(where) == 1:
        return Fault(f"{place}: one table received", f"there may be several: write [[{place}]], with two brackets")
    message = _list_of(item) or expected_input(item)
    if item["type"] == "string_pattern_mismatch":
        message = "give letters and digits of any script, '_', '-' and '.' only, and not dots alone"
    if isinstance(item["input"], dict):
        what, _, mend = item["msg"].removeprefix("Value error, ").partition("; ")
        return Fault(f"{place}: {what}", mend or "mend this field")
    received = f"{place}: {_short(repr(item['input']), 60)} received"
    if message.startswith(("give ", "did ")):
        return Fault(received, message)
    return Fault(f"{received}, {message}", "mend it")


def _list_of(item: Any) -> str:
    """What to give where a lone number stands for a list of so many: the number for each; empty for another fault."""
    key = str(item["loc"][-1]) if item["type"] == "list_type" and isinstance(item["input"], (int, float)) else ""
    fields = [section.model_fields[key] for section in SECTIONS.values() if key in section.model_fields]
    count = max((getattr(part, "min_length", 0) for field in fields for part in field.metadata), default=0)
    return f"give {counted(count, 'number')}, {key} = {[item['input']] * count}" if count else ""


def _near_key(key: str) -> str:
    """Suggestion for an unknown key of the scene file: the tables that know it, or a key that is spelled like it."""
    tables = [name for name, section in SECTIONS.items() if key in section.model_fields]
    if tables:
        return f"it belongs to {' or '.join(tables)}"
    return did_you_mean(nearest(key, (known for section in SECTIONS.values() for known in section.model_fields)))


def _short(text: str, length: int) -> str:
    """Text of a message on the scene file's schema on one line, cut to a length."""
    text = one_line(text)
    return text if len(text) <= length else text[: length - 3] + "..."
