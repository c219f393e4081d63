"""The command `rislam-rt trace SCENE`: finds all paths along a scene's trajectory, and writes paths or signals."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rislam_rt.cli.options import ChannelName, Depth, JsonFile, SceneFolder
from rislam_rt.cli.output_files import OUTPUT, check_ending, check_output, write_json
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.errors import ConfigError
from rislam_rt.storage.files import MARK

if TYPE_CHECKING:
    from rislam_rt.model import Paths, RadioConfig, Scene

SignalSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="radio.* as in a pipeline; with --signals seed, code (focused, random, zero), receiver.* too; repeatable.",
    ),
]

AT_REST = "at level 0"


class TraceResult(NamedTuple):
    """Result of `rislam-rt trace`: paths along the trajectory, time taken, and entries for JSON."""

    paths: "Paths"
    seconds: float
    """Time [s] that finding the paths took."""
    panel: str
    """Phase codes of the panel, in words."""
    content: dict[str, Any]
    """Further entries of the JSON file."""


def command(
    scene: SceneFolder,
    depth: Depth = 2,
    channel: ChannelName = "traced",
    signals: Annotated[
        bool, typer.Option("--signals", help="Write samples, true paths and estimates: a data set of signals.")
    ] = False,
    cycles: Annotated[int | None, typer.Option(min=1, help="Only the first so many cycles.")] = None,
    stride: Annotated[int, typer.Option(min=1, help="Of those, only every one in so many.")] = 1,
    set_: SignalSettings = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write NetCDF: all paths; <scene>-signals.nc by default with --signals."),
        OUTPUT,
    ] = None,
    deepmimo: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write a scenario of DeepMIMO v4, one scene a cycle: a new folder, lower case."
        ),
    ] = None,
    json: JsonFile = None,
) -> None:
    """Trace a scene along the agent's trajectory and print what was found, class by class.

    Example: rislam-rt trace paper_room --stride 50 --deepmimo scenarios/paper_room
    """
    from rislam_rt.cli.scene_arguments import open_scene
    from rislam_rt.pipeline.channels import prepare_channel
    from rislam_rt.pipeline.signal_simulation import load_signals_spec, signal_settings
    from rislam_rt.pipeline.specification.read_pipeline import load_radio
    from rislam_rt.report.exports.deepmimo import check_name, deepmimo_files
    from rislam_rt.report.terminal_tables import path_table, print_paths
    from rislam_rt.scene.scene_folder import safe_name
    from rislam_rt.scene.write import write_files
    from rislam_rt.storage.netcdf import NETCDF

    check_ending("--out", out, NETCDF)
    beyond = [word for word in set_ or () if not signals and not word.startswith("radio.")]
    if beyond:
        raise ConfigError(f"--set {beyond[0][:60]}: without --signals radio.* alone; add it, or leave this out")
    radio = signal_settings(load_signals_spec(set_ or ()))[0] if signals else load_radio(set_ or ())
    opened = open_scene(scene, radio)
    room = _part_of_motion(opened.scene, cycles, stride)
    if deepmimo is not None:
        check_name(deepmimo.name)
        if deepmimo.exists():
            raise ConfigError(f"--deepmimo {deepmimo}: exists already; give a folder that does not exist yet")
    prepare_channel(channel)
    if signals:
        traced = _trace_signals(
            room, channel, depth, set_ or (), out or Path(f"{safe_name(room.name)}-signals.nc"), opened.warn
        )
    else:
        opened.warn()
        traced = _trace_paths(room, radio, channel, depth, out)
    if deepmimo is not None:
        traced.content.setdefault("files", {})["deepmimo"] = str(deepmimo)
        write_files(deepmimo_files(room, traced.paths, radio, depth), deepmimo)
    table = path_table(traced.paths)
    print_paths(room.name, traced.paths, table, traced.seconds, traced.panel)
    for kind, file in traced.content.get("files", {}).items():
        typer.echo(f"{kind}: {file}")
    content = {"scene": room.name, "depth": depth, "cycles": len(room.agent), "source": traced.paths.source}
    write_json(json, {**content, "seconds": traced.seconds, "classes": table, **traced.content})


def _part_of_motion(scene: "Scene", cycles: int | None, stride: int) -> "Scene":
    """Scene for `rislam-rt trace` with every `stride`-th of its first `cycles`; an error if it has fewer."""
    from dataclasses import replace

    from rislam_rt.pipeline.run import check_one_piece

    if cycles is not None and cycles > len(scene.agent):
        raise ConfigError(f"--cycles: {cycles} received; the scene has {len(scene.agent)}, give no more")
    agent = scene.agent[:cycles:stride]
    check_one_piece(len(agent), "--cycles, --stride")
    return replace(scene, agent=agent)


def _trace_paths(scene: "Scene", radio: "RadioConfig", channel: str, depth: int, file: Path | None) -> TraceResult:
    """Find all paths along a scene's trajectory, RIS panel at phase level 0, and write them to a file if given."""
    from time import perf_counter

    from rislam_rt.pipeline.channels import build_channel
    from rislam_rt.pipeline.run_datasets import paths_to_dataset
    from rislam_rt.storage.netcdf import write_dataset

    begin = perf_counter()
    paths = build_channel(channel, scene, radio, depth).paths(scene.agent)
    seconds = perf_counter() - begin
    if file is None:
        return TraceResult(paths, seconds, AT_REST, {})
    write_dataset(paths_to_dataset(paths, scene.agent).assign_attrs(history=MARK), file)
    return TraceResult(paths, seconds, AT_REST, {"files": {"paths": str(file)}})


def _trace_signals(
    scene: "Scene", channel: str, depth: int, settings: Sequence[str], file: Path, warn: Callable[[], None]
) -> TraceResult:
    """Write the signals of `rislam-rt trace --signals`: find paths under codes, simulate samples and components."""
    from itertools import count
    from time import perf_counter

    import numpy as np

    from rislam_rt.pipeline import signal_simulation
    from rislam_rt.storage.netcdf import write_dataset

    check_output(file)
    spec = signal_simulation.load_signals_spec(settings)
    size = signal_simulation.signals_size(scene, spec)
    signal_simulation.check_space(file, size)
    warn()
    typer.echo(f"samples: {size}", err=True)
    codes, noise = np.random.default_rng(spec.seed).spawn(2)
    with show_progress() as tell:
        tell("trace", 0, 1)
        begin = perf_counter()
        paths = signal_simulation.coded_paths(scene, channel, depth, spec, rng=codes)
        seconds = perf_counter() - begin
        tell("trace", 1, 1)
        done = count(1)
        data = signal_simulation.build_signals(
            scene, paths, spec, rng=noise, on_cycle=lambda: tell("estimate", next(done), paths.num_cycles)
        )
    write_dataset(data.assign_attrs(history=MARK), file)
    shape = {
        **size._asdict(),
        "file_bytes": file.stat().st_size,
        "mean_components": signal_simulation.mean_components(data),
    }
    return TraceResult(
        paths, seconds, AT_REST if spec.code == "zero" else spec.code,
        {"files": {"signals": str(file)}, "signals": shape},
    )  # fmt: skip
