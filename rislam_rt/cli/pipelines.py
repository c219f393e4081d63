"""The command `rislam-rt pipelines`: lists the built-in pipelines and rooms."""

import typer

from rislam_rt.cli.options import JsonFile
from rislam_rt.cli.output_files import write_json


def command(json: JsonFile = None) -> None:
    """List the pipelines and the rooms that come with the package.

    Each can be given by its name wherever a pipeline file or a scene folder is asked for, in any folder.

    Example: rislam-rt pipelines --json pipelines.json
    """
    from rich.console import Console
    from rich.table import Table

    from rislam_rt.errors import SetupError
    from rislam_rt.shipped import first_sentence, shipped_missing, shipped_pipelines, shipped_rooms

    gone = [line for line in map(shipped_missing, ("pipelines", "scenes")) if line]
    if gone:
        raise SetupError(*gone)
    pipelines = {name: first_sentence(file) for name, file in shipped_pipelines().items()}
    rooms = shipped_rooms()
    table = Table("pipeline", "what it does")
    for name, sentence in pipelines.items():
        table.add_row(name, sentence)
    Console().print(table)
    typer.echo(f"rooms: {', '.join(rooms)}")
    write_json(json, {"pipelines": pipelines, "rooms": list(rooms)})
