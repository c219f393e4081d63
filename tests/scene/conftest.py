"""A small valid scene folder that tests damage in one place each."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A fresh copy of the paper's room."""
    return Path(shutil.copytree(SCENES / "paper_room", tmp_path / "room"))


@pytest.fixture
def damaged(room: Path) -> Callable[[str, str], Path]:
    """Replace a piece of text in the scene file, once; returns the folder."""

    def replace(old: str, new: str) -> Path:
        text = (room / "scene.toml").read_text()
        assert old in text
        (room / "scene.toml").write_text(text.replace(old, new, 1))
        return room

    return replace
