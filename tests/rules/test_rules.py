"""The package keeps its rules, and every rule would notice a breach."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rule_book as rules
from rule_book import ROOT, Source

RULES = (
    rules.floor_breaches,
    rules.truth_breaches,
    rules.foreign_breaches,
    rules.random_breaches,
    rules.pickle_breaches,
    rules.name_breaches,
    rules.size_breaches,
    rules.docstring_breaches,
)
DOC = '"""Doc."""\n'
OF_USERS = {"mine.py"}
"""Files of a user's own, named in examples."""


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_the_package_keeps_the_rule(rule: Callable[[Source], Iterator[str]]) -> None:
    sources = rules.package_sources()
    assert len(sources) > 30
    breaches = [breach for source in sources for breach in rule(source)]
    assert not breaches, "\n" + "\n".join(breaches)


def test_files_that_a_docstring_or_comment_names_are_there() -> None:
    sources = rules.package_sources()
    there = OF_USERS | {source.path.rpartition("/")[2] for source in sources}
    there |= {file.name for folder in ("benchmarks", "tests", "tools") for file in (ROOT / folder).rglob("*.py")}
    named = [(source.path, name) for source in sources for name in re.findall(r"`(?:\w+/)*(\w+\.py)`", source.text)]
    assert len(named) > 10
    gone = [f"{path} names {name}" for path, name in named if name not in there]
    assert not gone, "\n".join(gone)


@pytest.mark.parametrize(
    ("rule", "path", "text"),
    [
        (rules.floor_breaches, "geometry/a.py", "from rislam_rt.model import Scene"),
        (rules.floor_breaches, "geometry/a.py", "import rislam_rt.model.scene as s"),
        (rules.floor_breaches, "geometry/a.py", "from ..model import Scene"),
        (rules.floor_breaches, "geometry/a.py", "from rislam_rt import model"),
        (rules.floor_breaches, "geometry/a.py", "def f():\n    from rislam_rt.cli import main"),
        (rules.floor_breaches, "geometry/a.py", "from importlib import import_module\nimport_module('rislam_rt.cli')"),
        (rules.floor_breaches, "scene/a.py", "from rislam_rt.ris import rephase"),
        (rules.floor_breaches, "report/a.py", "from rislam_rt import load_scene"),
        (rules.floor_breaches, "attic/a.py", ""),
        (rules.truth_breaches, "slam/schemes/a.py", "from rislam_rt.channel.walls import Walls"),
        (rules.truth_breaches, "design/a.py", "from rislam_rt.scene import load_scene"),
        (rules.foreign_breaches, "pipeline/a.py", "import sionna.rt"),
        (rules.foreign_breaches, "channel/compare/a.py", "import mitsuba as mi"),
        (rules.foreign_breaches, "measurement/a.py", "import drjit as dr"),
        (rules.foreign_breaches, "pipeline/a.py", "from pickle import load"),
        (rules.foreign_breaches, "evaluate/a.py", "from random import choice"),
        (rules.random_breaches, "slam/a.py", "np.random.seed(1)"),
        (rules.random_breaches, "slam/a.py", "x = numpy.random.normal(size=3)"),
        (rules.random_breaches, "slam/a.py", "rng = np.random.default_rng()"),
        (rules.random_breaches, "slam/a.py", "def f(x, rng): pass"),
        (rules.random_breaches, "slam/a.py", "def f(x, *, rng=None): pass"),
        (rules.pickle_breaches, "slam/a.py", "np.load(file, allow_pickle=True)"),
        (rules.pickle_breaches, "slam/a.py", "eval(text)"),
        (rules.name_breaches, "slam/path_utils.py", ""),
        (rules.name_breaches, "common/a.py", ""),
        (rules.size_breaches, "slam/a.py", "x = 1\n" * 401),
        (rules.size_breaches, "slam/a.py", "def f():\n" + "    x = 1\n" * 61),
        (rules.docstring_breaches, "slam/a.py", "x = 1"),
        (rules.docstring_breaches, "slam/a.py", DOC + "def f(): pass"),
        (rules.docstring_breaches, "slam/a.py", DOC + f"class A:\n    {DOC}\n    def f(self): pass"),
    ],
)
def test_a_breach_is_noticed(rule: Callable[[Source], Iterator[str]], path: str, text: str) -> None:
    assert list(rule(Source(path, text)))


@pytest.mark.parametrize(
    ("rule", "path", "text"),
    [
        (rules.floor_breaches, "slam/a.py", "from rislam_rt.model import Paths\nfrom rislam_rt.slam.b import c"),
        (rules.floor_breaches, "cli/a.py", "from rislam_rt import __version__"),
        (rules.floor_breaches, "arrays.py", "from rislam_rt.errors import GeometryError"),
        (rules.truth_breaches, "pipeline/a.py", "from rislam_rt.channel import Channel"),
        (rules.foreign_breaches, "channel/traced/a.py", "import sionna.rt\nimport drjit"),
        (rules.foreign_breaches, "tracer_backend.py", "import drjit"),
        (rules.random_breaches, "slam/a.py", "def f(*, rng: np.random.Generator): rng.random(3)"),
        (rules.random_breaches, "slam/a.py", "rng = np.random.default_rng(seed)"),
        (rules.pickle_breaches, "slam/a.py", "np.load(file, allow_pickle=False)\nmi.eval(x)"),
        (rules.name_breaches, "slam/commonality.py", ""),
        (rules.docstring_breaches, "slam/a.py", DOC + "def _f(): pass"),
    ],
)
def test_what_is_allowed_passes(rule: Callable[[Source], Iterator[str]], path: str, text: str) -> None:
    assert not list(rule(Source(path, text)))


def test_no_folder_is_crowded() -> None:
    assert not list(rules.crowded_folders(rules.package_sources()))
    full = [Source("a/b.py", "x = 1\n" * 2000), Source("a/c.py", "x = 1\n" * 501), Source("a/d/e.py", "x = 1\n" * 2500)]
    assert list(rules.crowded_folders(full)) == ["a: 2501 lines"]


def test_no_folder_imports_in_a_circle() -> None:
    assert not list(rules.circular_folders(rules.package_sources()))


@pytest.mark.parametrize(
    ("texts", "circle"),
    [
        ({"a/b.py": "from rislam_rt.a import c", "a/c.py": "from rislam_rt.a.d import e", "a/d.py": ""}, False),
        ({"a/b.py": "from rislam_rt.a import c", "a/c.py": "def f():\n    from rislam_rt.a.b import e"}, True),
        ({"a/b/c.py": "from rislam_rt.a.d import e", "a/d.py": "from rislam_rt.a.b.f import g", "a/b/f.py": ""}, True),
        ({"a/__init__.py": "from rislam_rt.a.b import c", "a/b.py": "from rislam_rt.a import c"}, True),
        ({"a/b/c.py": "from rislam_rt.a.d import e", "a/d.py": "from rislam_rt.b.f import g", "b/f.py": ""}, False),
        ({"a.py": "from rislam_rt.b.c import d", "b/c.py": "import rislam_rt.a"}, True),
    ],
)
def test_a_circle_is_noticed(texts: dict[str, str], circle: bool) -> None:
    found = list(rules.circular_folders([Source(path, text) for path, text in texts.items()]))
    assert bool(found) == circle, found


def test_every_folder_stands_on_a_floor() -> None:
    present = {source.folder for source in rules.package_sources()} - {"__init__"}
    assert present <= set(rules.FLOOR_OF)


def test_no_committed_text_names_a_package_registry() -> None:
    texts = {path: _text(path) for path in _committed()}
    breaches = [breach for path, text in texts.items() for breach in rules.registry_breaches(path, text)]
    assert not breaches, "\n" + "\n".join(breaches)
    assert list(rules.registry_breaches("a.lock", f"--index-url https://{rules.REGISTRIES[0]}/simple"))
    assert not list(rules.registry_breaches("a.md", "registries are not named here"))


def test_no_lock_file_holds_an_address() -> None:
    locks = [path for path in _committed() if path.endswith(".lock") or "requirements" in path]
    assert not [path for path in locks if "://" in _text(path)]


def test_test_files_have_names_of_their_own() -> None:
    """Without packages in tests/, pytest imports by base name: a second one of a name is an error there."""
    names = [path.stem for path in (ROOT / "tests").rglob("test_*.py")]
    assert len(names) == len(set(names)), sorted(name for name in set(names) if names.count(name) > 1)


@pytest.mark.parametrize("module", ["rislam_rt", "rislam_rt.model", "rislam_rt.scene", "rislam_rt.design"])
def test_importing_stays_light(module: str) -> None:
    """The tracer takes seconds to import, trimesh and plots half a second: only who uses them pays."""
    heavy = ("sionna", "mitsuba", "drjit", "trimesh", "matplotlib", "sklearn", "pandas", "xarray")
    code = f"import sys, {module}; print([m for m in {heavy!r} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.strip() == "[]"


def _committed() -> list[str]:
    """Files under version control; outside a repository, those a source archive would hold."""
    listed = subprocess.run(["git", "ls-files", "-z"], capture_output=True, text=True, check=False, cwd=ROOT)
    if listed.returncode == 0:
        return [path for path in listed.stdout.split("\0") if path and (ROOT / path).is_file()]
    skipped = {".venv", ".git", "runs", "build", "dist"}
    files = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
    return [path.as_posix() for path in files if not skipped & set(path.parts)]


def _text(path: str) -> str:
    return Path(ROOT / path).read_text(encoding="utf-8", errors="ignore")
