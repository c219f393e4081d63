"""Written scenes read back equal, appear whole or not at all, and overwrite nothing unasked."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import SceneError, StoreError
from rislam_rt.model import Scene
from rislam_rt.scene import load_scene, new_scene, write_scene
from rislam_rt.scene.write import write_files
from rislam_rt.shipped import shipped_rooms

SCENES = Path(__file__).parents[2] / "scenes"


def assert_equal(a: Scene, b: Scene) -> None:
    assert a.name == b.name
    assert a.landmarks == b.landmarks
    for one, other in zip(a.reflectors, b.reflectors, strict=True):
        assert one.name == other.name
        assert one.material == other.material
        assert np.array_equal(one.triangles, other.triangles)
    for one, other in zip(a.scatterers, b.scatterers, strict=True):
        assert np.array_equal(one.position, other.position)
        assert (one.rcs, one.radius) == (other.rcs, other.radius)
    for one, other in zip(a.panels, b.panels, strict=True):
        assert np.array_equal(one.center, other.center)
        assert (one.name, one.host) == (other.name, other.host)
        # normal and up are brought to length 1 once more on reading
        assert np.allclose(one.spec.offsets(), other.spec.offsets(), rtol=0, atol=1e-15)
        assert (one.spec.levels, one.spec.element) == (other.spec.levels, other.spec.element)
    # TUM files have nine digits
    assert np.allclose(a.agent.position, b.agent.position, rtol=0, atol=1e-8)
    assert np.allclose(a.agent.heading, b.agent.heading, rtol=0, atol=1e-8)
    assert np.allclose(a.agent.tx, b.agent.tx, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", sorted(shipped_rooms()))
def test_written_scene_reads_back_equal(name: str, tmp_path: Path) -> None:
    scene = load_scene(SCENES / name)
    again = load_scene(write_scene(scene, tmp_path / "deep" / name))
    assert_equal(scene, again)
    assert sorted(path.name for path in (tmp_path / "deep").iterdir()) == [name]


def test_digest_follows_content(room: Path) -> None:
    first = load_scene(room).digest
    assert first == load_scene(room / "scene.toml").digest == load_scene(SCENES / "paper_room").digest
    (room / "meshes/floor.ply").write_bytes((room / "meshes/ceiling.ply").read_bytes())
    second = load_scene(room).digest
    (room / "scene.toml").write_text((room / "scene.toml").read_text() + "# a remark\n")
    third = load_scene(room).digest
    assert len({first, second, third}) == 3


def test_existing_folder_is_left_alone(tmp_path: Path) -> None:
    scene = load_scene(SCENES / "paper_room")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("keep")
    with pytest.raises(SceneError, match=r"does not exist yet$"):
        write_scene(scene, tmp_path / "mine")
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]
    write_scene(scene, tmp_path / "mine", overwrite=True)
    assert (tmp_path / "mine/notes.txt").read_text() == "keep"
    assert_equal(scene, load_scene(tmp_path / "mine"))
    with pytest.raises(SceneError, match=r"does not exist yet, or --overwrite \(in Python overwrite=True\)$"):
        write_scene(scene, tmp_path / "mine")


def test_a_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StoreError, match="No space left on device"):
        write_scene(load_scene(SCENES / "paper_room"), tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for folder, overwrite in (("file/below", False), ("file", True)):
        with pytest.raises(SceneError, match="file: is not a folder"):
            write_files({"a": b""}, tmp_path / folder, overwrite=overwrite)


@pytest.mark.parametrize("foreign", ["README.md", "scene.toml", "meshes/floor.ply"])
def test_what_another_made_is_never_replaced(tmp_path: Path, foreign: str) -> None:
    """Not even with `overwrite`, which is for rooms of this program's making: as written, or as its README says."""
    theirs = tmp_path / "project" / foreign
    theirs.parent.mkdir(parents=True)
    theirs.write_text("# notes = 'my own'")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SceneError, match=f"'{re.escape(foreign)}' there is not of this program's making"):
        new_scene("paper_room", tmp_path / "project", overwrite=True)
    assert sorted(tmp_path.rglob("*")) == before
    assert theirs.read_text() == "# notes = 'my own'"


def test_a_room_of_ours_is_replaced_when_told_so_though_it_was_edited(tmp_path: Path) -> None:
    room = new_scene("paper_room", tmp_path / "mine")
    (room / "scene.toml").write_text((room / "scene.toml").read_text() + "# a remark\n")
    new_scene("l_room", room, overwrite=True)
    scene = load_scene(SCENES / "paper_room")
    written = write_scene(scene, tmp_path / "bare")  # without a README, and as it was written
    assert_equal(scene, load_scene(write_scene(scene, written, overwrite=True)))
    (written / "scene.toml").write_text("# mine now\n" + (written / "scene.toml").read_text())
    with pytest.raises(SceneError, match=r"'scene\.toml' there is not"):
        write_scene(scene, written, overwrite=True)


def test_new_scene_from_a_template(tmp_path: Path) -> None:
    folder = new_scene("l_room", tmp_path / "mine")
    assert_equal(load_scene(folder), replace(load_scene(SCENES / "l_room"), name="mine"))
    with pytest.raises(SceneError, match="give one of empty_box, "):
        new_scene("attic", tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_cross_section_apart_from_the_sphere_is_kept(tmp_path: Path) -> None:
    scene = load_scene(SCENES / "paper_room")
    for changed in (replace(scene.scatterers[0], rcs=0.02), replace(scene.scatterers[0], rcs=0.02, radius=None)):
        room = replace(scene, scatterers=(changed,))
        again = load_scene(write_scene(room, tmp_path / str(changed.radius)))
        assert (again.scatterers[0].rcs, again.scatterers[0].radius) == (0.02, changed.radius)


def test_a_folder_by_another_name_is_not_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.toml").write_text("mine")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match=r"exists already; give a folder that does not exist yet$"):
        new_scene("paper_room", Path("missing") / "..")  # nor would --overwrite replace it
    assert (tmp_path / "scene.toml").read_text() == "mine"
    with pytest.raises(SceneError, match="too long"):
        new_scene("paper_room", "x" * 300)
