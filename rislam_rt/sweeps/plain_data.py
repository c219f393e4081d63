"""Plain data: conversion of a cell's result to numbers, text, lists and mappings as in JSON, and its dotted names."""

import math
from collections.abc import Mapping
from typing import Any

from rislam_rt.errors import RislamError


def plain_result(result: Any) -> dict[str, Any]:
    """Convert the result of a cell's function to plain data as in JSON: arrays to lists, NaN and infinity to None.

    Raises
    ------
    RislamError
        It is no mapping of names to numbers, text, lists and mappings of these.
    """
    if not isinstance(result, Mapping) or not all(isinstance(name, str) for name in result):
        raise RislamError(f"the cell returned {type(result).__name__}; return a mapping of names to values")
    return {name: _plain(name, value) for name, value in result.items()}


def _plain(name: str, value: Any) -> Any:
    """One value of a cell's result as plain data."""
    if hasattr(value, "tolist"):  # of numpy, which a worker does not import by itself: cells that need it do
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_plain(name, part) for part in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(f"{name}.{key}", part) for key, part in value.items()}
    raise RislamError(f"the cell returned {name} = {type(value).__name__}; return numbers, text, lists or mappings")
