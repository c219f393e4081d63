"""A small valid scene folder that tests damage in one place each."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rislam_rt.scene.built_in_rooms import ROOMS
from rislam_rt.scene.templates import room_files


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A fresh copy of the paper's room."""
    folder = tmp_path / "room"
    for name, content in room_files(ROOMS["paper_room"]()).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


@pytest.fixture
def damaged(room: Path) -> Callable[[str, str], Path]:
    """Replace a piece of text in the scene file, once; returns the folder."""

    def replace(old: str, new: str) -> Path:
        text = (room / "scene.toml").read_text()
        assert old in text
        (room / "scene.toml").write_text(text.replace(old, new, 1))
        return room

    return replace
