"""The digest of a method of one's own changes with every file that it is made of, and with no other."""

import hashlib
from pathlib import Path

import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline import own_methods
from rislam_rt.pipeline.own_methods import large_sources, load_own, own_digest, own_digests, own_sources

FILES = {
    "mine.py": "import numpy as np\nimport beside\nfrom tools import deep\n",
    "beside.py": "from tools.more import thing\n",
    "tools/__init__.py": "",
    "tools/deep.py": "from . import near\n",
    "tools/near.py": "from .further.inner import x\n",
    "tools/more.py": "thing = 1\n",
    "tools/further/__init__.py": "",
    "tools/further/inner.py": "x = 1\n",
    "stranger.py": "y = 1\n",
    "tools/unused.py": "z = 1\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_every_file_that_is_imported_counts_and_no_other(folder: Path, name: str) -> None:
    before = own_digest(folder / "mine.py")
    (folder / name).write_text(FILES[name] + "# changed\n")
    unused = name in ("stranger.py", "tools/unused.py")
    assert (own_digest(folder / "mine.py") == before) == unused


def test_it_is_the_same_in_another_folder(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    other = tmp_path_factory.mktemp("elsewhere") / "copy"
    folder.rename(other)
    moved = own_digest(other / "mine.py")
    other.rename(folder)
    assert moved == own_digest(folder / "mine.py")


def test_a_file_alone_is_its_bytes(tmp_path: Path) -> None:
    file = tmp_path / "alone.py"
    file.write_text("import numpy\nimport json\n")
    assert own_digest(file) == hashlib.sha256(file.read_bytes()).hexdigest()
    file.write_text("import alone\n")  # itself
    assert own_digest(file) == hashlib.sha256(file.read_bytes()).hexdigest()
    file.write_text("this is no Python\n")
    assert own_digest(file) == hashlib.sha256(file.read_bytes()).hexdigest()


def test_within_a_package_absolute_names_are_looked_up_from_its_root(folder: Path) -> None:
    (folder / "tools" / "deep.py").write_text("import tools.more\n")
    before = own_digest(folder / "tools" / "deep.py")
    (folder / "tools" / "more.py").write_text("thing = 2\n")
    assert own_digest(folder / "tools" / "deep.py") != before


def test_of_an_installed_method_its_own_package_counts_and_no_library_beside_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own_methods, "INSTALLED", {folder})
    monkeypatch.syspath_prepend(folder)
    (folder / "tools" / "deep.py").write_text("import beside\nfrom . import near\n")
    digests = {name: own_digest(folder / name) for name in ("mine.py", "tools/deep.py")}
    (folder / "beside.py").write_text("a_library = 1\n")
    assert {name: own_digest(folder / name) for name in digests} == digests
    (folder / "tools" / "further" / "inner.py").write_text("x = 2\n")
    assert own_digest(folder / "mine.py") == digests["mine.py"]
    assert own_digest(folder / "tools" / "deep.py") != digests["tools/deep.py"]


DESIGNER = "def design(belief, panel, radio, *, rng):\n    return 0\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of modules of this test alone, named after it, on the path of imports, ahead of `behind`."""
    for folder in ("behind", "front"):
        (tmp_path / folder).mkdir()
        monkeypatch.syspath_prepend(tmp_path / folder)
    return tmp_path / "front"


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def test_a_folder_that_is_no_package_is_kept_in_the_copy(place: Path) -> None:
    methods = f"methods_{place.parent.name}"
    name, more = f"{methods}.nm:design", f"import {methods}.more\n"
    write(place, {f"{methods}/nm.py": more + DESIGNER, f"{methods}/more.py": "x = 1\n"})
    digests = own_digests([name])
    assert set(own_sources(digests)) == {f"{methods}/nm.py", f"{methods}/more.py"}
    write(place, {f"{methods}/more.py": "x = 2\n"})
    assert own_digests([name]) != digests


def test_of_two_files_of_one_name_that_which_is_imported_is_copied(place: Path) -> None:
    one, two, tool = (f"{word}_{place.parent.name}" for word in ("one", "two", "tool"))
    write(place, {f"{one}.py": f"import {tool}\n{DESIGNER}", f"{tool}.py": "first = 1\n"})
    write(place.parent / "behind", {f"{two}.py": f"import {tool}\n{DESIGNER}", f"{tool}.py": "second = 1\n"})
    found = own_sources(own_digests([f"{one}:design", f"{two}:design"]))
    assert set(found) == {f"{one}.py", f"{two}.py", f"{tool}.py"}
    assert found[f"{tool}.py"] == b"first = 1\n"


def test_a_large_file_is_not_copied_and_said(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"large_{place.parent.name}"
    write(place, {f"{name}.py": DESIGNER})
    assert large_sources([f"{name}:design", "random"]) == []
    monkeypatch.setattr(own_methods, "LARGEST", 10)
    assert own_sources(own_digests([f"{name}:design"])) == {}
    (line,) = large_sources([f"{name}:design", "random"])
    assert line.startswith(f"{name}.py: 0.0 MB, and a run's folder holds copies of at most")


def test_the_hint_names_the_file_in_its_folder() -> None:
    with pytest.raises(ConfigError, match=r"no module 'nowhere\.nm'; put nowhere/nm\.py beside the pipeline file"):
        load_own("nowhere.nm:design")
