"""Numbers at the top of the default filter's modules are declared, each with its reason, and no other is."""

import ast
import re
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType

from rule_book import ROOT

KINDS = {"limit", "rounding", "unit", "model"}
ROW = re.compile(r"^\| `(\w+)` \((\w+)\) \| [^|]+ \| (\w+) \| [^|]{10,} \|$", re.MULTILINE)
PAGE = (ROOT / "docs" / "slam.md").read_text(encoding="utf-8")
DECLARED = {(module, name): kind for name, module, kind in ROW.findall(PAGE)}
"""Module and name of each number of the page's table, and its kind."""


def _benchmark() -> ModuleType:
    """The benchmark that halves and doubles the numbers, and so knows them."""
    spec = spec_from_file_location("constants_benchmark", ROOT / "benchmarks" / "filter" / "constants.py")
    assert spec
    assert spec.loader
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_number_beside_the_constants_is_declared() -> None:
    there = {(place.rpartition(".")[2], name) for place, name in _benchmark().numbers()}
    assert there - set(DECLARED) == set(), "declare it in docs/slam.md, `Numbers beside the constants`, with its reason"
    assert set(DECLARED) - there == set(), "gone: take it from the table in docs/slam.md"
    assert set(DECLARED.values()) <= KINDS


def test_the_page_counts_them() -> None:
    of_models = list(DECLARED.values()).count("model")
    assert f"stand {len(DECLARED)} numbers, {of_models} of which belong to a model" in PAGE


def test_a_number_is_noticed_however_it_is_set() -> None:
    set_by = _benchmark().names_set
    lines = ("NEW = 0.3", "NEW: float = 0.3", "NEW, OLD = 0.3, 1", "OLD = NEW = 0.3")
    assert all("NEW" in set_by(ast.parse(line).body[0]) for line in lines)
    assert not set_by(ast.parse("print(NEW)").body[0])
