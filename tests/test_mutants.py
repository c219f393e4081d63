"""The places that `benchmarks/mutants.py` changes stand where it says: a rename takes them along. How it counts."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "benchmarks" / "mutants.py"


@pytest.fixture(scope="module")
def mutants() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mutants", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutants"] = module
    spec.loader.exec_module(module)
    return module


def test_every_mutant_has_its_place(mutants: ModuleType) -> None:
    assert len(mutants.MUTANTS) > 10
    for mutant in mutants.MUTANTS:
        text = (ROOT / "rislam_rt" / mutant.file).read_text(encoding="utf-8")
        assert not mutant.before or text.count(mutant.before) == 1, f"{mutant.name}: {mutant.file}"


def test_every_file_where_a_mutant_is_looked_for_is_there(mutants: ModuleType) -> None:
    for mutant in mutants.MUTANTS:
        assert not mutant.where or len(mutant.where) >= mutant.files, mutant.name
        for file in mutants.likeliest(mutant):
            assert (ROOT / file).is_file(), f"{mutant.name}: {file}"
    assert set(mutants.likeliest(mutants.MUTANTS[0])) == {f"tests/{f}" for one in mutants.MUTANTS for f in one.where}


def test_a_verdict_asks_for_tests_and_for_files(mutants: ModuleType) -> None:
    nothing, mutant = mutants.MUTANTS[:2]
    spread, heap = [f"{name}.py::t" for name in "abc"], [f"a.py::t{number}" for number in range(9)]
    assert mutants.verdict(mutant, spread) == mutants.verdict(mutant, heap) == "TOO FEW"
    assert mutants.verdict(mutant, [*spread, *heap]) == mutants.verdict(nothing, []) == "good"
    assert mutants.verdict(nothing, ["a.py::t"]) == "BREAKS"


def test_it_goes_on_to_the_next_file_and_stops_at_enough(tmp_path: Path) -> None:
    """Four files of ten tests that fail, of which five in three are asked for: three of a file are enough."""
    for name in "abcd":
        text = "import pytest\n@pytest.mark.parametrize('n', range(10))\ndef test(n):\n    assert False\n"
        (tmp_path / f"test_{name}.py").write_text(text)
    files = [f"test_{name}.py" for name in "cabd"]
    words = [sys.executable, SCRIPT, "--inside", "--enough", "5", "3", "--tests", *files]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    broken = [line.split()[1].partition("::")[0] for line in done.stdout.splitlines() if line.startswith("BROKEN ")]
    assert broken == 3 * files[:1] + 3 * files[1:2] + files[2:3]


@pytest.mark.parametrize(
    ("words", "said"), [(["--workers", "0"], "--workers 0"), (["--tests", "no.py"], "--tests no.py")]
)
def test_what_cannot_be_run_is_told_in_a_line(
    mutants: ModuleType, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    with pytest.raises(SystemExit):
        mutants.main(words)
    assert f"error: {said}" in capsys.readouterr().err
