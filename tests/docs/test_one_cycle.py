"""The page on one cycle at a time: its example runs as it stands, and localises."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "one_cycle.md"


def test_the_pages_example_localises(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    exec(compile(code, str(PAGE), "exec"), {})
    error, _, said = capsys.readouterr().out.partition(" ")
    assert float(error) < 0.01
    assert said.startswith("MapEstimate: ")
    assert "panel known" in said
