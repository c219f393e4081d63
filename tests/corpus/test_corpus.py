"""The corpus of malformed input: each case ends in one line that says what is wrong, and in exit code 2."""

import shutil
import tomllib
from pathlib import Path

import pytest

from rislam_rt.errors import RislamError
from rislam_rt.pipeline import load_spec
from rislam_rt.scene import check_scene, load_scene

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
STRAIGHT = ("start = [0.5, 0.7, 0.5]\n", "cycles = 600\ncycle_s = 0.1\n")


def cases(name: str) -> list[object]:
    """The cases of a file, each named by its number and what is odd about it."""
    found = tomllib.loads((HERE / f"{name}.toml").read_text())["case"]
    return [
        pytest.param(c, id=f"{n}-{str(c.get('new') or c.get('setting') or c['says'])[:30]!a}")
        for n, c in enumerate(found)
    ]


def refusal(read: object, says: str) -> str:
    """What `read` raises is declared, of one line, and exit code 2."""
    with pytest.raises(RislamError) as caught:
        read()  # type: ignore[operator]
    line = str(caught.value)
    assert says in line
    assert line.isprintable()
    assert len(line) < 1000
    assert caught.value.exit_code == 2
    return line


def refused(room: Path, says: str) -> None:
    """Loader and check answer a scene with the same line, which names the file."""
    line = refusal(lambda: load_scene(room), says)
    assert line.startswith(f"{room}/scene.toml: ")
    assert line.startswith(next(finding.line for finding in check_scene(room) if finding.severity == "error"))


@pytest.fixture
def room(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROOT / "scenes" / "paper_room", tmp_path / "room"))


@pytest.mark.parametrize("case", cases("scenes"))
def test_scene(case: dict[str, str], room: Path) -> None:
    text = (room / "scene.toml").read_text()
    assert case["old"] in text
    changed = text.replace(case["old"], case["new"], 1)
    if "[limits]" in changed:  # a table comes after the plain keys, which are all at the top
        head, _, rest = changed.partition("[limits]")
        limits, _, rest = rest.partition("\n\n")
        changed = f"{head}\n{rest}\n[limits]{limits}\n"
    (room / "scene.toml").write_text(changed)
    refused(room, case["says"])


@pytest.mark.parametrize("case", cases("meshes"))
def test_mesh_or_trajectory(case: dict[str, str], room: Path) -> None:
    scene = room / "scene.toml"
    text = scene.read_text()
    if case["file"].endswith(".tum"):
        for words in STRAIGHT:
            text = text.replace(words, "")
        text = text.replace("velocity = [0.0707, 0.0707, 0.0]", 'trajectory = "path.tum"')
        (room / "path.tum").write_text(case["content"])
    else:
        text = text.replace("meshes/floor.ply", f"meshes/{case['file']}")
        (room / "meshes" / case["file"]).write_text(case["content"])
    scene.write_text(text)
    refused(room, case["says"])


@pytest.mark.parametrize("case", cases("pipelines"))
def test_pipeline(case: dict[str, str]) -> None:
    refusal(lambda: load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [case["setting"]]), case["says"])
