"""The command `rislam-rt new SCENE`: makes a scene folder from a built-in or random room, a file or a floor plan."""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from rislam_rt.cli.options import parse_point
from rislam_rt.errors import ConfigError
from rislam_rt.toml import parse_toml

Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the files of a room that this program made.")]
_ROOM = "paper_room"


def command(
    scene: Annotated[
        Path, typer.Argument(metavar="SCENE", help="Folder to make; it must not exist yet.", show_default=False)
    ],
    template: Annotated[str, typer.Option(help="Built-in room to start from.")] = _ROOM,
    overwrite: Overwrite = False,
    seed: Annotated[
        int | None, typer.Option(min=0, help="A random room instead: the one that 'unseen' draws from this number.")
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="A room from a file: GLB, glTF, OBJ, PLY, STL, a floor plan, a scene of Mitsuba or Sionna RT (XML); "
            "or sionna:NAME, a scene that Sionna RT brings along.",
        ),
    ] = None,
    within: Annotated[
        str, typer.Option(metavar="X0,Y0,X1,Y1", help="Of an XML scene: this window of the plan alone, in metres.")
    ] = "",
    floorplan: Annotated[
        str | None, typer.Option(metavar="CORNERS", help='One room by its corners in metres, e.g. "0,0 4,0 4,3 0,3".')
    ] = None,
    height: Annotated[float, typer.Option(min=1.0, max=100.0, help="Of a floor plan's rooms, in metres.")] = 2.7,
    units: Annotated[
        Literal["mm", "cm", "m", "in"] | None, typer.Option(help="What a unit of the file is; metres without it.")
    ] = None,
    up: Annotated[Literal["y", "z"] | None, typer.Option(help="Axis that points up; y for glTF, else z.")] = None,
    origin: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Point that becomes the room's zero, in metres, z up.")
    ] = "0,0,0",
    material: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=MATERIAL", help="Of a wall, node or material of the file (patterns too); "
                     "itu:concrete, itu:concrete:0.2 (thickness in m) or reflection:0.8; repeatable."),
    ] = None,
    rest: Annotated[str, typer.Option(metavar="MATERIAL", help="Material of all else.")] = "itu:concrete",
    carrier_ghz: Annotated[
        float, typer.Option(min=0.1, max=1000.0, help="Carrier of an import; small and round are in its wavelengths.")
    ] = 10.0,
    detail: Annotated[
        float, typer.Option(min=0.0, max=1e4, help="What is flat but narrower than this many wavelengths shades.")
    ] = 3.0,
    curved: Annotated[Literal["shade", "planes"], typer.Option(help="What cylinders become.")] = "shade",
    scan: Annotated[
        bool | None, typer.Option("--scan/--no-scan", help="The mesh is a scan, with noise; as it looks without it.")
    ] = None,
    fill: Annotated[float, typer.Option(min=0.0, help="Holes of a scan up to so many m² are filled.")] = 1.0,
    max_walls: Annotated[int, typer.Option(min=4, max=10_000, help="Of a file with more the widest reflect.")] = 150,
) -> None:  # fmt: skip
    """Make a scene folder from a built-in room, of a random one, or from a file of another program, to be edited.

    Example: rislam-rt new myroom --template two_scatterers
    """
    from rislam_rt.scene import new_scene, write_scene

    _one_origin(source, floorplan, seed, template)
    before = _named_files(scene) if overwrite else set()
    if source is not None and (source.suffix.lower() == ".xml" or str(source).startswith("sionna:")):
        own = {"--units": units, "--up": up, "--origin": origin != "0,0,0", "--material": material}
        _from_xml(source, scene, within, [name for name, value in own.items() if value], overwrite, carrier_ghz)
        _tell_left(scene, before)
        return
    if within:
        raise ConfigError("--within: only XML scenes are cut to a window; leave it out")
    needless = {"--units": units, "--up": up, "--material": material, "--origin": origin != "0,0,0", "--scan": scan}
    useless = [name for name, value in needless.items() if value]
    if source is None and floorplan is None and useless:
        raise ConfigError(f"{useless[0]}: it says how a file lies; give --from FILE, or leave it out")
    if source is not None or floorplan is not None:
        from rislam_rt.scene.importing import ImportOptions, import_corners, import_room
        from rislam_rt.scene.importing.materials import parse_choices, parse_material
        from rislam_rt.scene.importing.mesh_source import ANY_UNIT

        x, y, z = parse_point("--origin", origin, ANY_UNIT).tolist()
        options = ImportOptions(
            units=units, up=up, origin=(x, y, z), carrier_ghz=carrier_ghz, detail=detail, curved=curved, scan=scan,
            max_walls=max_walls, fill=fill, materials=parse_choices(material or []),
            rest=parse_material(rest, "--rest"),
        )  # fmt: skip
        remarks = (
            import_room(source, scene, options, height=height, overwrite=overwrite)
            if source is not None
            else import_corners(floorplan or "", scene, options, height=height, overwrite=overwrite)
        )
        for remark in remarks:
            typer.echo(f"- {remark}")
        made = f"{scene}: made from '{source or 'a floor plan'}'"
    elif seed is not None:
        from rislam_rt.scene.random_rooms import draw_room

        room = draw_room(seed)
        about = f"Made by `rislam-rt new --seed {seed}`: {room.shape}, {room.motion}."
        write_scene(room.scene, scene, overwrite=overwrite, about=about)
        made = f"{scene}: random room {seed} ({room.shape}, {room.motion})"
    else:
        made = f"{new_scene(template, scene, overwrite=overwrite)}: made from '{template}'"
    _tell_left(scene, before)
    typer.echo(f"{made}; edit its scene.toml")


def _named_files(folder: Path) -> set[str]:
    """Files that the scene file in a folder names, of which `new --overwrite` tells those that remain; none where it
    cannot be read."""
    try:
        table = parse_toml((folder / "scene.toml").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    parts = [part for value in table.values() for part in (value if isinstance(value, list) else [value])]
    named = [part.get(key) for part in parts if isinstance(part, dict) for key in ("mesh", "trajectory")]
    return {name for name in named if isinstance(name, str)}


def _tell_left(folder: Path, before: set[str]) -> None:
    """Part of `rislam-rt new --overwrite`: say which files of the room that was there before remain, as no file is
    deleted."""
    left = sorted(name for name in before - _named_files(folder) if os.path.isfile(folder / name))
    if left:
        more = f" and {len(left) - 8} more" if len(left) > 8 else ""
        typer.echo(f"- of the room before remain, unused: {', '.join(left[:8])}{more}; delete what you do not need")


def _one_origin(source: Path | None, floorplan: str | None, seed: int | None, template: str) -> None:
    """Check that the options of `new` name one origin of the room: a file, a floor plan, a seed or a template."""
    origins = {"--from": source, "--floorplan": floorplan, "--seed": seed, "--template": template}
    given = [name for name, value in origins.items() if value not in (None, _ROOM)]
    if len(given) > 1:
        raise ConfigError(f"{given[1]}: a room comes from it or from {given[0]}; leave one out")


def _from_xml(source: Path, folder: Path, within: str, useless: list[str], overwrite: bool, carrier_ghz: float) -> None:
    """Part of `rislam-rt new`: a scene folder from an XML scene, for whose units and materials options are
    `useless`."""
    from rislam_rt.scene.xml import new_from_xml

    if useless:
        raise ConfigError(f"{useless[0]}: an XML scene is in metres, z up, and names its materials; leave it out")
    try:
        window = [float(word) for word in within.split(",")] if within.strip() else []
    except ValueError:
        raise ConfigError(f"--within: '{within[:60]}' received; give numbers parted by commas") from None
    for note in new_from_xml(str(source), folder, within=window, overwrite=overwrite, carrier_ghz=carrier_ghz):
        typer.echo(f"- {note}")
    typer.echo(f"{folder}: made from '{source}'; edit its scene.toml")
