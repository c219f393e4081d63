"""List of all settings of a pipeline file with default, unit, range and meaning, read from the typed models."""

import ast
import inspect
import sys
from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from itertools import pairwise
from typing import Any, Literal, NamedTuple, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import did_you_mean, nearest, unit_of
from rislam_rt.pipeline.specification.pipeline_spec import RECORDS
from rislam_rt.pipeline.specification.section import Choices, Section


class Setting(NamedTuple):
    """One setting of a pipeline file: key, default, type, range, unit, meaning."""

    key: str
    """Dotted key, as `slam.sigma_a`."""
    default: Any
    required: bool
    kind: str
    """Type in plain words."""
    allowed: str
    """Range or choices; empty if everything of its kind is allowed."""
    unit: str
    meaning: str


def list_settings(model: type[BaseModel], prefix: str = "") -> list[Setting]:
    """List all settings of a pipeline file's typed model, those of its tables after its own."""
    plain, tables = [], []
    for name, field in model.model_fields.items():
        below = field.annotation
        if isinstance(below, type) and issubclass(below, BaseModel):
            tables += list_settings(below, f"{prefix}{name}.")
            continue
        owner = next(part for part in model.__mro__ if name in inspect.get_annotations(part))
        meaning = _meanings(RECORDS.get(owner, owner)).get(name, "")  # a record's fields, of a table made from one
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        kind, allowed = _kind(below), _of_constraints(field)
        plain.append(Setting(f"{prefix}{name}", default, field.is_required(), kind, allowed, unit_of(name), meaning))
    return plain + tables


def explain(settings: list[Setting], key: str) -> list[Setting]:
    """Setting of a pipeline file with that dotted key, or with the only key that ends with it; of a table all settings,
    and then those elsewhere whose keys end with its name.

    Raises
    ------
    ConfigError
        There is none, or several.
    """
    exact = [one for one in settings if one.key == key]
    found = exact or [one for one in settings if one.key.endswith(f".{key}")]
    table = [one for one in settings if one.key.startswith(f"{key}.")]
    if table or len(found) == 1:
        return [*table, *found]
    if found:
        raise ConfigError(
            f"--explain {key}: several settings end so; give one of {', '.join(one.key for one in found)}"
        )
    raise ConfigError(f"--explain {key[:80]}: no such setting; {_near(key, [one.key for one in settings])}")


def _near(key: str, keys: list[str]) -> str:
    """Hint at settings with a key like an unknown one."""
    inside = [one for one in keys if key and key in one]
    if inside:
        more = f" and {len(inside) - 6} more" if len(inside) > 6 else ""
        return f"there are {', '.join(inside[:6])}{more}"
    ends = [one for one in keys if nearest(key.rpartition(".")[2], [one.rpartition(".")[2]])]
    return did_you_mean(nearest(key, keys, 3) or ends[:3]) or "`rislam-rt config` lists them all"


@cache
def _meanings(declared: type) -> dict[str, str]:
    """Meanings of settings by name: docstrings of the fields of a class and its parents, in one line each."""
    found: dict[str, str] = {}
    for parent in declared.__bases__:
        found |= _meanings(parent) if is_dataclass(parent) or issubclass(parent, Section) else {}
    tree = _classes(declared.__module__).get(declared.__name__)  # None of a table that was made from a record
    for field, doc in pairwise(tree.body if tree else ()):
        if isinstance(field, ast.AnnAssign) and isinstance(doc, ast.Expr) and isinstance(doc.value, ast.Constant):
            assert isinstance(field.target, ast.Name)
            found[field.target.id] = " ".join(str(doc.value.value).split())
    return found


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """Syntax trees of a module's classes by name, from which the settings' docstrings are read."""
    body = ast.parse(inspect.getsource(sys.modules[module])).body
    return {node.name: node for node in body if isinstance(node, ast.ClassDef)}


def _kind(annotation: Any) -> str:
    """Type of a setting in plain words, for the list."""
    names = {int: "whole number", float: "number", bool: "true or false", str: "text"}
    if annotation in names:
        return names[annotation]
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return "text" if isinstance(args[0], str) else "number"
    if origin in (list, tuple):
        return "list"
    if origin is dict:
        return "table"
    inner = [_kind(arg) for arg in args if arg is not type(None) and not isinstance(arg, FieldInfo)]
    return inner[0] if inner else "table"


def _of_constraints(field: FieldInfo) -> str:
    """Range or choices of a setting in words, from the constraints of its type; empty without any."""
    metadata = list(field.metadata)
    for part in get_args(field.annotation):  # inside an optional or a list
        for item in getattr(part, "__metadata__", ()):
            metadata += item.metadata if isinstance(item, FieldInfo) else (item,)
    choices = list(_choices(field.annotation)) + [name for m in metadata if isinstance(m, Choices) for name in m.names]
    if choices:
        return "one of " + ", ".join(map(str, choices))
    words = {Ge: "at least", Gt: "above", Le: "at most", Lt: "below"}
    return ", ".join(
        f"{word} {_short(getattr(item, kind.__name__.lower()))}"
        for kind, word in words.items()
        for item in metadata
        if isinstance(item, kind)
    )


def _choices(annotation: Any) -> Iterator[Any]:
    """Values that the list gives for a setting of literal type, also inside an optional or a list."""
    if get_origin(annotation) is Literal:
        yield from get_args(annotation)
    else:
        for part in get_args(annotation):
            yield from _choices(part)


def _short(value: float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
