"""The places that `benchmarks/mutants.py` changes stand where it says: a rename takes them along."""

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_every_mutant_has_its_place() -> None:
    spec = importlib.util.spec_from_file_location("mutants", ROOT / "benchmarks" / "mutants.py")
    assert spec is not None
    assert spec.loader is not None
    mutants = importlib.util.module_from_spec(spec)
    sys.modules["mutants"] = mutants
    spec.loader.exec_module(mutants)
    assert len(mutants.MUTANTS) > 10
    for mutant in mutants.MUTANTS:
        text = (ROOT / "rislam_rt" / mutant.file).read_text(encoding="utf-8")
        assert not mutant.before or text.count(mutant.before) == 1, f"{mutant.name}: {mutant.file}"
