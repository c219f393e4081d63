"""Pages of the site that the program writes about itself: every command, every setting."""

from collections.abc import Iterator
from typing import Any

import typer
from mkdocs.structure.files import File, Files

from rislam_rt.cli.app import app
from rislam_rt.pipeline.specification.settings_list import Setting, list_settings
from rislam_rt.shipped import first_sentence, shipped_pipelines
from rislam_rt.studies import load_any

WIDTHS = ".md-typeset td:first-child code {white-space: nowrap} .md-typeset td:nth-child(2) {min-width: 9rem}"
"""Of the table of settings: names are not broken in the middle, and what they mean has room on a narrow screen."""


def on_files(files: Files, config: Any) -> Files:
    """Add the pages before the site is put together."""
    for name, lines in (("cli", cli_page()), ("settings", settings_page())):
        files.append(File.generated(config, f"reference/{name}.md", content="\n".join(lines) + "\n"))
    return files


def cli_page() -> Iterator[str]:
    """Every command with its arguments and options."""
    yield "# Command line\n"
    yield "`rislam-rt COMMAND --help` says the same. Exit codes: 0 done, 1 a failure in the work, 2 bad"
    yield "input, 3 the machine lacks something, 4 the disk, 130 interrupted.\n"
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        context = command.context_class(command, info_name=f"rislam-rt {name}")
        yield f"## {name}\n\n```\n{' '.join(command.get_usage(context).split())}\n```\n"
        yield f"{_escaped(command.help)}\n"
        yield "| argument | meaning |\n| --- | --- |"
        for parameter in command.params:
            record = parameter.get_help_record(context)
            if record is not None:
                yield f"| `{_cell(record[0])}` | {_text(record[1])} |"
        yield ""


def settings_page() -> Iterator[str]:
    """Every setting of every kind of pipeline, one section a kind."""
    yield "# Settings\n"
    yield "What a pipeline file may say. `rislam-rt config [PIPELINE]` prints the same as a file to edit,"
    yield "`rislam-rt config --explain KEY` one of them; `--set KEY=VALUE` changes one on the command line.\n"
    yield f"<style>{WIDTHS}</style>\n"
    seen: set[type] = set()
    for file in sorted(shipped_pipelines().values(), key=lambda file: file.stem != "trace_then_slam"):
        model = type(load_any(file))
        if model in seen:
            continue
        seen.add(model)
        yield f"## {file.stem}\n\n{first_sentence(file)}\n"
        yield "| setting | meaning | default | allowed |\n| --- | --- | --- | --- |"
        yield from map(_row, list_settings(model))
        yield ""


def _row(one: Setting) -> str:
    default = "required" if one.required else f"`{_short(one.default)}`"
    return "| " + " | ".join((f"`{one.key}`", _text(one.meaning), f"{default} {one.unit}", _text(one.allowed))) + " |"


def _short(value: Any) -> str:
    text = "not set" if value is None else str(value) or '""'
    return _cell(text if len(text) <= 40 else text[:37] + "...")


def _text(text: str) -> str:
    return _escaped(_cell(text))


def _escaped(text: str) -> str:
    """A word in angle brackets is not HTML, outside of code."""
    return text.replace("<", "&lt;")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
