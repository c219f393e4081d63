"""A run: trace the room once, then lead every scheme through all cycles under the same noise."""

import platform
from collections.abc import Callable, MutableMapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter
from typing import NamedTuple

import numpy as np

from rislam_rt.backend import prepare_backend
from rislam_rt.channel.protocol import Channel
from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.model import (
    PathKind,
    Paths,
    RadioConfig,
    Scene,
    SchemeResult,
    SlamResult,
    Trajectory,
)
from rislam_rt.pipeline.choose import build_designer
from rislam_rt.pipeline.control import check_control, open_link
from rislam_rt.pipeline.cycle import Agent, Cycle, Rng, Room, run_cycle
from rislam_rt.pipeline.record import gather
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.spec import PipelineSpec, Settings, build_settings
from rislam_rt.pipeline.workers import run_side_by_side
from rislam_rt.slam import StartPrior, init

Progress = Callable[[str, int, int], None]
"""Told the stage (`trace` or a scheme), how much of it is done, and how much there is."""

LIBRARIES = ("numpy", "scipy", "sionna-rt", "mitsuba", "drjit", "karellen-llvm-core")
"""Libraries that numbers depend on; their versions go into every result."""


class Seeds(NamedTuple):
    """Every scheme draws the same start, noise, losses and filter numbers: only its codes differ."""

    start: np.random.SeedSequence
    noise: np.random.SeedSequence
    control: np.random.SeedSequence
    filter: np.random.SeedSequence
    design: np.random.SeedSequence


def run_slam(
    scene: Scene,
    spec: PipelineSpec,
    *,
    rng: np.random.Generator,
    jobs: int = 1,
    done: MutableMapping[str, SchemeResult] | None = None,
    progress: Progress | None = None,
) -> SlamResult:
    """Run all schemes of a specification in a room.

    Parameters
    ----------
    rng
        Source of all randomness, through children; the same seed gives the same result, whatever other schemes run.
    jobs
        Schemes that run at the same time, in processes of their own if more than one; the result is the same.
    done
        Schemes that need not run again; each new one is put there as soon as it is complete.
    progress
        Called after tracing and after every cycle.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (see `check_run`).
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    check_run(scene, spec)
    settings = build_settings(spec)
    scene = cut_scene(scene, spec.cycles)
    done = {} if done is None else done
    tell = progress or (lambda stage, at, total: None)
    seeds = Seeds(*rng.bit_generator.seed_seq.spawn(len(Seeds._fields)))  # type: ignore[attr-defined]

    tell("trace", 0, 1)
    begin = perf_counter()
    paths = build_channel(spec.channel, scene, settings.radio, spec.depth).paths(scene.agent)
    seconds = {"trace": perf_counter() - begin}
    tell("trace", 1, 1)
    todo = [name for name in spec.schemes if name not in done]
    for name, scheme in run_side_by_side(run_scheme, todo, (scene, paths, spec, seeds), jobs, tell):
        if isinstance(scheme, RislamError):
            raise scheme
        done[name] = scheme
    return SlamResult(
        name=spec.name,
        scene=scene,
        paths=replace(paths, ris=None),
        schemes={name: done[name] for name in spec.schemes},
        config=spec.model_dump(mode="json"),
        seed=_seed_of(rng),
        versions=library_versions(),
        seconds=seconds,
    )


def run_scheme(name: str, scene: Scene, paths: Paths, spec: PipelineSpec, seeds: Seeds, tell: Progress) -> SchemeResult:
    """One scheme over all cycles."""
    settings = build_settings(spec)
    scheme, motion = SCHEMES[name], scene.agent
    panel = scene.ris.spec if scene.ris is not None and scheme.method is not None else None
    room = Room(paths if panel is not None else without_panel(paths), motion)
    designer = build_designer(scheme, panel, room, spec, settings) if panel is not None else None
    filter_rng, design_rng = np.random.default_rng(seeds.filter), np.random.default_rng(seeds.design)
    state = init(
        _start(motion, spec, seeds, settings), motion.body, panel, settings.radio, settings.slam, rng=filter_rng
    )
    agent = Agent(state, open_link(panel) if panel is not None else None)
    noise, control = (_children(s, len(motion)) for s in (seeds.noise, seeds.control))
    cycles: list[Cycle] = []
    tell(name, 0, len(motion))
    for cycle in range(len(motion)):
        rng = Rng(design_rng, control[cycle], noise[cycle], filter_rng)
        agent, outcome = run_cycle(agent, room, cycle, panel, designer, settings, spec.control, rng=rng)
        cycles.append(outcome)
        tell(name, cycle + 1, len(motion))
    return gather(name, cycles, panel.levels if panel is not None else 0)


def check_run(scene: Scene, spec: PipelineSpec) -> None:
    """Check that scene and specification fit, before anything is traced or written.

    Raises
    ------
    ConfigError
        The budget is not the cycle, there are fewer cycles than asked for, or a scheme needs a panel that is not there.
    """
    motion, budget = scene.agent, spec.budget
    if spec.cycles is not None and spec.cycles > len(motion):
        raise ConfigError(f"cycles: {spec.cycles} received; the scene has {len(motion)}, give no more")
    total = budget.optimise_s + budget.communicate_s + budget.measure_s + budget.localise_s
    step = float(motion.time[1] - motion.time[0]) if len(motion) > 1 else total
    if abs(total - step) > 1e-9:
        raise ConfigError(f"budget: the four steps sum to {total:g} s; make them the scene's cycle of {step:g} s")
    if scene.ris is None:
        need = [name for name in spec.schemes if SCHEMES[name].method is not None]
        if need:
            raise ConfigError(f"schemes: '{need[0]}' needs a panel and scene '{scene.name}' has none; give 'no_ris'")
    else:
        check_control(scene.ris.spec, spec.control)


def prepare_channel(kind: str) -> None:
    """Make sure that the machine can do what a channel needs, before anything is written.

    Raises
    ------
    SetupError
        It cannot.
    """
    if kind == "traced":
        prepare_backend()


def build_channel(kind: str, scene: Scene, radio: RadioConfig, depth: int) -> Channel:
    """The channel of that name; the tracer is imported only if it is asked for."""
    if kind == "traced":
        from rislam_rt.channel.traced import TracedChannel

        return TracedChannel(scene, radio, depth)
    from rislam_rt.channel.image_source import ImageSourceChannel

    return ImageSourceChannel(scene, radio, depth)


def cut_scene(scene: Scene, cycles: int | None) -> Scene:
    """The scene with its trajectory's first cycles alone."""
    return scene if cycles is None else replace(scene, agent=scene.agent[:cycles])


def without_panel(paths: Paths) -> Paths:
    """The paths of a plain wall where the panel hangs: identities stay, panel paths are never there."""
    panel = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    return replace(paths, valid=paths.valid & ~panel, gain=np.where(panel, 0.0, paths.gain), ris=None)


def library_versions() -> dict[str, str]:
    """Versions of this package, of Python and of the libraries that numbers depend on."""
    from rislam_rt import __version__

    found = {"rislam-rt": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def _start(motion: Trajectory, spec: PipelineSpec, seeds: Seeds, settings: Settings) -> StartPrior:
    """What the agent is told: the truth plus one draw of the prior's errors; a known height is told exactly."""
    rng = np.random.default_rng(seeds.start)
    axes = np.array([1.0, 1.0, 1.0 if settings.slam.height == "estimated" else 0.0])
    position_std, velocity_std = spec.start.position_std_m, spec.start.velocity_std_m_s
    return StartPrior(
        motion.position[0] + rng.standard_normal(3) * position_std * axes,
        motion.velocity[0] + rng.standard_normal(3) * velocity_std * axes,
        float(motion.heading[0]),
        position_std,
        velocity_std,
    )


def _seed_of(rng: np.random.Generator) -> int | None:
    """The integer that the generator was made from, if it was."""
    entropy = getattr(rng.bit_generator.seed_seq, "entropy", None)
    return entropy if isinstance(entropy, int) else None


def _children(seed: np.random.SeedSequence, count: int) -> list[np.random.Generator]:
    """One generator a cycle, the same ones every time, however many numbers a cycle draws."""
    keys = (np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, cycle)) for cycle in range(count))
    return [np.random.default_rng(key) for key in keys]
