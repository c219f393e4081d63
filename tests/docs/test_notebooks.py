"""The notebooks run from their first cell to their last, in an empty folder; no Jupyter is needed to know it."""

import json
from pathlib import Path

import matplotlib as mpl
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SHORTER = {'"optimized", ': "", '"depth=1"]': '"depth=1", "receiver.estimator=bound"]'}
"""In the longest one: its own scheme alone, heard by the receiver that is quick."""


def test_there_are_three() -> None:
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize(
    ("file", "other"),
    [
        (NOTEBOOKS[0], {}),
        (NOTEBOOKS[1], {}),
        (NOTEBOOKS[2], SHORTER),
        pytest.param(NOTEBOOKS[2], {}, marks=pytest.mark.slow),
    ],
    ids=["room", "channels", "designer", "designer as it is"],
)
def test_a_notebook_runs(file: Path, other: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    mpl.use("agg")
    names: dict[str, object] = {}
    for number, cell in enumerate(json.loads(file.read_text())["cells"]):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            source = "".join(cell["source"])
            for old, new in other.items():
                source = source.replace(old, new)
            exec(compile(source, f"{file.name}, cell {number}", "exec"), names)
    import matplotlib.pyplot as plt

    assert len(plt.get_fignums()) == 1
    drawn = plt.gcf()
    drawn.savefig(tmp_path / "figure.png")
    assert all(axes.has_data() for axes in drawn.axes)
    plt.close("all")
