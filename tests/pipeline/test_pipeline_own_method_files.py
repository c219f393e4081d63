"""The digest of a method of one's own changes with every file that it is made of, and with no other."""

import hashlib
from pathlib import Path

import pytest

from rislam_rt.pipeline.own_methods import own_digest

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
