"""The notebooks run from their first cell to their last, in an empty folder; no Jupyter is needed to know it."""

import json
from pathlib import Path

import matplotlib as mpl
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def test_there_are_three() -> None:
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    mpl.use("agg")
    names: dict[str, object] = {}
    for number, cell in enumerate(json.loads(file.read_text())["cells"]):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec(compile("".join(cell["source"]), f"{file.name}, cell {number}", "exec"), names)
    import matplotlib.pyplot as plt

    assert len(plt.get_fignums()) == 1
    drawn = plt.gcf()
    drawn.savefig(tmp_path / "figure.png")
    assert all(axes.has_data() for axes in drawn.axes)
    plt.close("all")
