"""The command line app (Typer) of `rislam-rt` with all commands."""

from importlib import import_module

import typer

from rislam_rt.cli.output_files import with_overwrite
from rislam_rt.cli.verbosity import with_verbosity

COMMANDS = (
    "run", "sweep", "slam", "pipelines", "config", "new", "check", "export", "show", "trace", "compare", "design",
    "report", "score", "doctor",
)  # fmt: skip
"""Commands in the order of the help, each a module of this folder with a function `command`."""

app = typer.Typer(
    name="rislam-rt",
    epilog="Exit codes: 0 done, 1 a failure in the work, 2 bad input, 3 the machine lacks something, 4 the disk, "
    "130 interrupted.",
    add_completion=True, pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
for _name in COMMANDS:
    app.command(_name)(with_verbosity(with_overwrite(import_module(f"rislam_rt.cli.{_name}").command)))


def _print_version(wanted: bool) -> None:
    """Print the package's version and leave, for the option `--version`."""
    if wanted:
        from rislam_rt import __version__

        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", help="Print the version and leave.", is_eager=True, callback=_print_version
    ),
) -> None:
    """Ray-traced propagation and SLAM with a reconfigurable intelligent surface."""
