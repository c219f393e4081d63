"""A command, run as a user would."""

import sys
from collections.abc import Iterator
from functools import cache

import pytest
import typer

from rislam_rt.cli import main


@pytest.fixture(scope="session", autouse=True)
def parser_built_once() -> Iterator[None]:
    """Typer makes the parser of all commands anew for every command that it runs; one serves them all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Run a command in an empty folder; returns exit code, output and error stream."""
    monkeypatch.chdir(tmp_path)

    def _run(*arguments):
        monkeypatch.setattr(sys, "argv", ["rislam-rt", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main()
        captured = capsys.readouterr()
        return left.value.code, captured.out, captured.err

    return _run
