"""The rooms under `scenes/` are what their builders write."""

from pathlib import Path

import numpy as np
import pytest
from build_scenes import built_files, main
from built_in_rooms import ROOMS

from rislam_rt.scene import load_scene
from rislam_rt.scene.meshes import MeshReader

SCENES = Path(__file__).parents[2] / "scenes"
NAMES = sorted(ROOMS)


def test_every_committed_room_has_a_builder() -> None:
    assert sorted(path.parent.name for path in SCENES.glob("*/scene.toml")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_builder_writes_what_is_committed(name: str) -> None:
    files = built_files(name)
    folder = SCENES / name
    assert sorted(files) == sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    for path, content in files.items():
        committed = (folder / path).read_bytes()
        if path.endswith(".glb"):  # its header names the version of the library that wrote it
            ours, theirs = MeshReader().parse(content, path), MeshReader().parse(committed, path)
            assert np.array_equal(ours.vertices, theirs.vertices)
            assert np.array_equal(ours.faces, theirs.faces)
        elif path.endswith((".ply", ".tum")):  # the last digit may differ between mathematical libraries
            assert len(content) == len(committed)
        else:
            assert content == committed, path
    assert sum(map(len, files.values())) < 500_000


def test_builder_command_writes_and_refuses_to_overwrite(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper_room", "--out", str(tmp_path)]) == 0
    assert load_scene(tmp_path / "paper_room").digest == load_scene(SCENES / "paper_room").digest
    assert main(["paper_room", "--out", str(tmp_path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["paper_room", "--out", str(tmp_path), "--overwrite"]) == 0
    with pytest.raises(SystemExit, match="2"):
        main(["no_such_room", "--out", str(tmp_path)])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["paper_room"]
