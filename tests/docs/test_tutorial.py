"""The commands of the pages: options that are there in every page, and the tutorial run from a wheel."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
FENCE = re.compile(r"^```\w*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def test_every_command_of_the_pages_has_options_that_are_there() -> None:
    from typer.main import get_command

    from rislam_rt.cli.app import app

    commands = get_command(app).commands  # type: ignore[attr-defined]
    seen = 0
    for page in PAGES:
        for block in FENCE.findall(page.read_text(encoding="utf-8")):
            for line in re.split(r"\n|&&|\|", block.replace("\\\n", " ")):
                if not line.strip().startswith("rislam-rt ") or "COMMAND" in line:
                    continue
                words = shlex.split(line, comments=True)
                command = commands[words[1]]
                known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)}
                given = {word.partition("=")[0] for word in words if re.match("--?[a-z]", word)}
                assert given <= known, f"{page.name}: {line}"
                seen += 1
    assert seen > 50


def test_each_question_has_its_section() -> None:
    page = (ROOT / "docs" / "questions.md").read_text(encoding="utf-8")
    assert re.findall("^## (.*)$", page, re.MULTILINE) == [
        "My own measurements",
        "My own filter on your data",
        "My own phase designer",
        "All settings",
        "What is in this file",
        "Why was the panel not found",
        "Plot what is stored",
        "Cite",
        "What may I rely on",
        "Make it faster",
    ]
    for section in page.split("\n## ")[1:]:
        assert re.search(r"\]\([\w/]+\.md(#[\w-]+)?\)", section), section[:40]


def test_the_page_knows_every_reason_of_the_report() -> None:
    source = (ROOT / "rislam_rt" / "report" / "conclusions.py").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "questions.md").read_text(encoding="utf-8")
    told = re.findall(r'(?:return|yield) f?"([^"]+)"', source.partition("def _missing")[2].partition("\ndef _words")[0])
    told = [reason.removeprefix("{name}: ") for reason in told if "why_not" not in reason]
    assert len(told) == 9
    for reason in told:
        assert re.sub(r"\{[^}]*\}", "N", reason) in page


@pytest.mark.slow
def test_the_tutorial_runs_from_a_wheel_in_an_empty_folder() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "benchmarks" / "runs" / "installed.py"],
        capture_output=True,
        text=True,
        timeout=290,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "  in all" in done.stdout
    assert "rmse_m: " in done.stdout
