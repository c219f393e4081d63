"""A run of the pipeline: find all paths along the trajectory once, then simulate every scheme with the same noise."""

import platform
from collections.abc import Mapping, MutableMapping
from contextlib import suppress
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter
from typing import NamedTuple

import numpy as np

from rislam_rt.blas_threads import in_one_blas_thread
from rislam_rt.errors import ConfigError, RislamError, expect
from rislam_rt.measurement.config import check_half_turn
from rislam_rt.model import Body, Paths, Scene, SchemeResult, SlamResult
from rislam_rt.pipeline.assumed_model import tilted_motion
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.control_link import check_control
from rislam_rt.pipeline.cycle import Receptions, usual_step
from rislam_rt.pipeline.estimators import Estimator, use_directions
from rislam_rt.pipeline.own_method_files import large_sources
from rislam_rt.pipeline.room.array_warnings import array_warnings
from rislam_rt.pipeline.room.diffuse_clutter import check_diffuse, trace_diffuse_clutter
from rislam_rt.pipeline.room.late_paths import direct_path_warnings, late_path_warnings
from rislam_rt.pipeline.room.motion_warnings import motion_warnings
from rislam_rt.pipeline.room.scene_overrides import change_room
from rislam_rt.pipeline.room.true_motion import draw_looks, draw_motion
from rislam_rt.pipeline.scheme_simulation import SchemeSimulation
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.seeds import Seeds, spawn_seeds
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.ris import delay_spread_warnings
from rislam_rt.scene.check import material_errors
from rislam_rt.scene.findings import raise_errors
from rislam_rt.worker_pool import run_side_by_side

LIBRARIES = ("numpy", "scipy", "sionna-rt", "mitsuba", "drjit", "karellen-llvm-core")
"""Libraries that a run's numbers depend on; their versions are written into every result."""
IN_ONE_PIECE = 50_000
"""Most cycles of a run that is held in memory as a whole: 5 GB in the paper's room."""
CYCLE_BYTES = 100_000
"""Memory of the paths of one cycle [bytes], in the paper's room with two bounces."""


class RunSetup(NamedTuple):
    """What all schemes of a run share: scene with the true motion, true paths, seeds."""

    scene: Scene
    """With the true motion of this run as its trajectory."""
    paths: Paths
    """True paths along the motion, RIS panel at phase level 0."""
    body: Body
    """Tx and Rx offsets of a level agent."""
    seeds: Seeds
    seconds: float
    """Time [s] that finding the paths took."""
    extras: Paths | None = None
    """Diffuse and diffracted paths; None if none are wanted."""
    receptions: Receptions | None = None
    """Cache of measurements that schemes with the same codes share; None to keep none."""


def set_scene(scene: Scene, spec: PipelineSpec, *, rng: np.random.Generator) -> tuple[Scene, Body, Seeds]:
    """Scene of a run with its overrides and drawn true motion, the Tx and Rx offsets of a level agent, the seeds.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (see `check_run`).
    """
    check_run(scene, spec)
    seeds = spawn_seeds(rng=rng)
    scene = change_room(cut_scene(scene, spec.cycles), spec.room, rng=np.random.default_rng(seeds.room))
    motion_rng = np.random.default_rng(seeds.motion)
    motion = draw_motion(scene, spec.motion.sigma_a_m_s2, rng=motion_rng)
    motion = draw_looks(motion, np.radians(spec.motion.look_std_deg), rng=motion_rng)
    return replace(scene, agent=tilted_motion(motion, spec.told)), motion.body, seeds


def prepare_setup(scene: Scene, spec: PipelineSpec, *, rng: np.random.Generator) -> RunSetup:
    """Draw the true motion of a run and find all paths along it: what does not depend on noise, for all its schemes.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (see `check_run`).
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    check_one_piece(spec.cycles or len(scene.agent), "'rislam-rt run' goes in slices")
    scene, body, seeds = set_scene(scene, spec, rng=rng)
    begin = perf_counter()
    radio = build_radio(spec.radio)
    paths = build_channel(spec.channel, scene, radio, spec.depth).paths(scene.agent)
    extras = trace_diffuse_clutter(scene, radio, scene.agent, spec.extras)
    return RunSetup(scene, paths, body, seeds, perf_counter() - begin, extras)


def check_one_piece(cycles: int, way_out: str) -> None:
    """Check that a run held in memory as a whole has at most `IN_ONE_PIECE` cycles.

    Raises
    ------
    ConfigError
        There are more; the message ends with `way_out`.
    """
    if cycles > IN_ONE_PIECE:
        raise ConfigError(
            f"cycles: {cycles} in one piece received, some {cycles * CYCLE_BYTES / 1e9:.0f} GB; "
            f"give at most {IN_ONE_PIECE} ({way_out})"
        )


@in_one_blas_thread
def run_slam(
    scene: Scene, spec: PipelineSpec, *, rng: np.random.Generator, jobs: int = 1,
    done: MutableMapping[str, SchemeResult] | None = None, progress: Tell = tell_nobody,
) -> SlamResult:  # fmt: skip
    """Simulate all schemes of a pipeline specification in a scene, and return their estimates with the true paths.

    Parameters
    ----------
    rng
        Source of all randomness, through children; the same seed gives the same result, whatever other schemes run.
    jobs
        Schemes that run at the same time, in processes of their own if more than one; the result is the same.
    done
        Results of schemes that need not run again; each new one is put there as soon as it is complete.
    progress
        Called after tracing and after every cycle.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (see `check_run`).
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    expect("scene", scene, Scene)
    expect("spec", spec, PipelineSpec)
    expect("rng", rng, np.random.Generator)
    done = {} if done is None else done
    progress("trace", 0, 1)
    setup = prepare_setup(scene, spec, rng=rng)._replace(receptions=Receptions())
    progress("trace", 1, 1)
    todo = [name for name in spec.schemes if name not in done]
    for name, scheme in run_side_by_side(run_scheme, todo, (setup, spec), jobs, progress):
        if isinstance(scheme, RislamError):
            raise scheme
        done[name] = scheme
    seed = getattr(rng.bit_generator.seed_seq, "entropy", None)  # of a generator that was made from a whole number
    schemes = {name: done[name] for name in spec.schemes}
    return result_of(setup, spec, schemes, seed=seed if isinstance(seed, int) else None)


def result_of(
    setup: RunSetup, spec: PipelineSpec, schemes: Mapping[str, SchemeResult], *, seed: int | None
) -> SlamResult:
    """Result of a run from the results of its schemes and their common setup."""
    return SlamResult(
        name=spec.name, scene=setup.scene, paths=replace(setup.paths, ris=None), schemes=schemes,
        config=spec.model_dump(mode="json"), seed=seed, versions=library_versions(), seconds={"trace": setup.seconds},
        warnings=(*run_warnings(setup.scene, spec), *late_warnings(setup.scene, setup.paths, spec)),
    )  # fmt: skip


@in_one_blas_thread
def run_scheme(
    name: str, setup: RunSetup, spec: PipelineSpec, tell: Tell, estimator: Estimator | None = None
) -> SchemeResult:
    """Simulate one scheme over all cycles of a run, with the scheme's estimator unless another is given."""
    walk = SchemeSimulation(name, setup.scene, setup.body, spec, setup.seeds, estimator, setup.receptions)
    return walk.lead(setup.paths, 0, len(setup.scene.agent), tell, setup.extras)


def check_run(scene: Scene, spec: PipelineSpec) -> None:
    """Check that scene and pipeline specification of a run fit, before paths are traced or files written.

    Raises
    ------
    ConfigError
        The time budget is not the scene's cycle time, the scene has fewer cycles than asked for, a scheme needs a panel
        that is not there, its codes are to alternate and half a turn is not among its levels, the room cannot be
        changed as asked, or the channel cannot find the diffuse paths asked for.
    SceneError
        A wall's material is not specified at the radio's carrier.
    """
    raise_errors(list(material_errors(scene, f"scene '{scene.name}'", build_radio(spec.radio))))
    scene = change_room(scene, spec.room, rng=np.random.default_rng(0))
    check_diffuse(scene, spec.extras, spec.channel)
    motion, budget = scene.agent, spec.budget
    if spec.cycles is not None and spec.cycles > len(motion):
        raise ConfigError(f"cycles: {spec.cycles} received; the scene has {len(motion)}, give no more")
    step = usual_step(motion.time) or budget.total
    if not budget.fills(step):
        raise ConfigError(
            f"budget: the four steps sum to {budget.total:g} s; make them the scene's cycle of {step:g} s "
            f"({budget.options(budget.fitted(step))}), or give agent.cycle_s = {budget.total:g} in the scene, "
            "to which a recording is interpolated"
        )
    if scene.ris is None:
        need = [name for name in spec.schemes if SCHEMES[name].panel]
        if need:
            raise ConfigError(f"schemes: '{need[0]}' needs a panel and scene '{scene.name}' has none; give 'no_ris'")
        return
    if spec.receiver.alternation and any(SCHEMES[name].panel for name in spec.schemes):
        check_half_turn(scene.ris.spec.levels)
    check_control(scene.ris.spec, spec.control, spec.panel.bit_flip)


def cut_scene(scene: Scene, cycles: int | None) -> Scene:
    """Scene of a run with the first `cycles` of its trajectory alone; unchanged if None."""
    return scene if cycles is None else replace(scene, agent=scene.agent[:cycles])


def run_warnings(scene: Scene, spec: PipelineSpec) -> tuple[str, ...]:
    """Warnings of a run, one line each: a RIS panel so large that the band resolves its elements' delays, an agent
    faster than the receiver reckons with as it tells the panel's paths from others, or than its slot allows, or
    manoeuvring as on no floor, or a receive array that cannot tell directions that a scheme uses, or a file
    of an own method too large to be copied.

    A path over the panel has one delay in the model. Its gain is summed over the elements, so that it needs no far
    field.
    """
    panels = len(scene.panels) if any(SCHEMES[name].panel for name in spec.schemes) else 0
    settings = build_settings(spec, panels)
    place = f"scene '{scene.name}'"
    moving = motion_warnings(scene, settings.radio, settings.receiver, spec.budget, place)
    blind = array_warnings(settings.radio, f"pipeline '{spec.name}'") if use_directions(spec.schemes) else ()
    bandwidth, agent = spec.radio.bandwidth_ghz * 1e9, scene.agent
    used = scene.panels if panels else ()
    large = (delay_spread_warnings(panel.spec, panel.center, agent.tx, agent.rx, bandwidth) for panel in used)
    kept = large_sources([*spec.schemes, spec.channel])
    return (*(line for lines in large for line in lines), *(finding.line for finding in (*moving, *blind)), *kept)


def late_warnings(scene: Scene, paths: Paths, spec: PipelineSpec) -> tuple[str, ...]:
    """Warnings of a run: paths that come in later than the receiver hears, as `check` says, and a direct path that is
    earlier or later."""
    panels, place = (
        len(scene.panels) if any(SCHEMES[name].panel for name in spec.schemes) else 0,
        f"scene '{scene.name}'",
    )
    early = direct_path_warnings(paths, scene.agent.time, spec, place)
    return tuple(finding.line for finding in (*late_path_warnings(paths, build_settings(spec, panels), place), *early))


def library_versions() -> dict[str, str]:
    """Versions of this package, of Python and of the libraries that the numbers of a run depend on, by name."""
    from rislam_rt import __version__

    found = {"rislam-rt": __version__, "python": platform.python_version()}
    return found | _installed()


@cache
def _installed() -> dict[str, str]:
    """Versions of those of the libraries that are installed, looked up once: it reads their files."""
    found = {}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found
