"""Simulation of one scheme over the cycles of a run, all at once or slice by slice, and its result as arrays."""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.measurement import Clutter, FrontEnd
from rislam_rt.model import NOTHING, Body, PathKind, Paths, RisCode, Scene, SchemeResult
from rislam_rt.pipeline.assumed_model import perceived_paths, tell_belief
from rislam_rt.pipeline.code_policies import build_designer
from rislam_rt.pipeline.control_link import open_link
from rislam_rt.pipeline.cycle import Agent, Cycle, GroundTruth, Receptions, RunContext, run_cycle
from rislam_rt.pipeline.estimators import ESTIMATORS, Estimator
from rislam_rt.pipeline.recordings.inputs import RecordedInputs, given_of
from rislam_rt.pipeline.room.front_end import prepare_front_end
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.seeds import Seeds, child
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.progress import Tell
from rislam_rt.ris import draw_panel
from rislam_rt.storage.netcdf import padded


class SchemeSimulation:
    """Simulation of one scheme: agent, code policy, panel errors and generators, kept from slice to slice of a run.

    Memory does not grow with the cycles. Cycle k draws from generators of its own, so that the numbers are the same
    however the run is cut.
    """

    def __init__(
        self, name: str, scene: Scene, body: Body, spec: PipelineSpec, seeds: Seeds, estimator: Estimator | None = None,
        receptions: Receptions | None = None,
    ) -> None:  # fmt: skip
        self.scheme, self.name = SCHEMES[name], name
        self.motion, self.body = scene.agent, body
        self.front_end: FrontEnd | None = None
        panel = scene.ris.spec if scene.ris is not None and self.scheme.panel else None
        settings = build_settings(spec, 0 if panel is None else len(panel.panels))
        compass, self.sway = (child(seeds.told, number) for number in range(2))
        start = np.random.default_rng(seeds.start)
        told = tell_belief(self.motion, body, panel, spec, settings, start=start, compass=compass)
        self.faults, designer = None, None
        if panel is not None:
            self.faults = draw_panel(panel, spec.panel.tolerance, rng=np.random.default_rng(seeds.panel))
            designer = build_designer(self.scheme, panel, spec, settings, told)
        estimator = estimator or ESTIMATORS[self.scheme.estimator]
        filter_rng, design_rng = np.random.default_rng(seeds.filter), np.random.default_rng(seeds.design)
        self.context = RunContext(
            panel, designer, estimator, spec, settings, told, seeds, filter_rng, design_rng, receptions
        )
        config = estimator.config(told.settings)
        state = estimator.init(told.start, told.body, told.panel, told.settings.sensor, config, rng=filter_rng)
        self.agent = Agent(state, open_link(panel) if panel is not None else None)

    @property
    def foresight(self) -> int:
        """Number of cycles after a slice whose paths the scheme's simulation needs: the genie designs for the cycle of
        the code's use."""
        return self.context.spec.control.delay_cycles if self.scheme.on_truth else 0

    def lead(self, paths: Paths, first: int, last: int, tell: Tell, extras: Paths | None = None) -> SchemeResult:
        """Simulate the scheme's cycles from `first` to `last` (not included), and return their result.

        True `paths` and diffuse paths `extras` begin at `first` and may go on beyond `last`.
        """
        if self.context.panel is None:
            paths = without_panel(paths)
        motion, wavelength = self.motion[first : first + paths.num_cycles], self.context.settings.radio.wavelength
        told, since = self.context.spec.told, float(self.motion.time[0])
        shift = doppler_shift(paths, motion, wavelength)
        clutter, twin = None, deepcopy(self.sway)  # one array hears both
        if extras is not None:
            extras = perceived_paths(extras, motion, told, rng=twin, since=since)
            clutter = Clutter(extras, doppler_shift(extras, motion, wavelength))
        heard = perceived_paths(paths, motion, told, rng=self.sway, since=since)
        if first == 0:
            build = np.random.default_rng(self.context.seeds.hardware)
            self.front_end = prepare_front_end(heard, motion, self.body, self.context.settings, rng=build)
        room = GroundTruth(heard, self.motion, shift, self.faults, first, self.front_end, clutter)
        cycles: list[Cycle] = []
        tell(self.name, first, len(self.motion))
        for cycle in range(first, last):
            self.agent, outcome = run_cycle(self.agent, room, cycle, self.context)
            cycles.append(outcome)
            tell(self.name, cycle + 1, len(self.motion))
        given = given_of(self.context.told, first, cycles, self.context.seeds.filter, since)
        levels = self.context.panel.levels if self.context.panel is not None else 0
        found = gather(self.name, self.motion.time[first:last], cycles, levels, given)
        # a slice does not know what later ones tell of its end
        whole = first == 0 and last == len(self.motion)
        return replace(found, smoothed=self.context.estimator.smoothed(self.agent.state)) if whole else found


def without_panel(paths: Paths) -> Paths:
    """Paths to simulate a scheme without the RIS panel: paths over it are kept as columns, but never valid."""
    panel = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    return replace(paths, valid=paths.valid & ~panel, gain=np.where(panel, 0.0, paths.gain), ris=None)


def gather(scheme: str, time: Floats, cycles: Sequence[Cycle], levels: int, given: RecordedInputs) -> SchemeResult:
    """Stack the records of a scheme's simulated cycles at `time` (K,) [s] as one result, landmarks by number."""
    estimates = [cycle.estimate for cycle in cycles]
    maps = [estimate.map for estimate in estimates]
    ident = np.unique(np.concatenate([m.ident for m in maps]))
    parent = np.full(len(ident), -1)
    held = np.zeros((len(cycles), len(ident)), dtype=np.bool_)
    landmark = np.zeros((len(cycles), len(ident), 3))
    ris_probability = np.zeros((len(cycles), len(ident)))
    panel = np.zeros(held.shape, dtype=np.int64) if any(m.panel is not None for m in maps) else None
    for row, m in enumerate(maps):
        column = np.searchsorted(ident, m.ident)
        held[row, column], landmark[row, column] = True, m.position
        image = np.flatnonzero(m.parent >= 0)
        parent[column[image]] = m.ident[m.parent[image]]
        ris_probability[row, column] = m.ris_probability
        if panel is not None and m.panel is not None:  # an empty map has none
            panel[row, column] = m.panel
    names = ("position", "velocity", "heading", "covariance")
    pose: dict[str, Any] = {name: np.array([getattr(estimate, name) for estimate in estimates]) for name in names}
    infos = [cycle.info for cycle in cycles]
    scalars = [name for name, value in infos[0]._asdict().items() if isinstance(value, bool | int | float | np.number)]
    return SchemeResult(
        scheme=scheme, time=time, **pose,
        sent=_codes([cycle.sent for cycle in cycles]), applied=_codes([cycle.applied for cycle in cycles]),
        levels=levels, gain=np.array([cycle.gain for cycle in cycles]),
        component_path=padded([cycle.truth.path for cycle in cycles], NOTHING, np.int64),
        component_landmark=padded([info.landmark for info in infos], NOTHING, np.int64), ident=ident,
        parent=parent, held=held, landmark_position=landmark, ris_probability=ris_probability,
        seconds=np.array([cycle.seconds for cycle in cycles]),
        info={name: np.array([float(getattr(info, name)) for info in infos]) for name in scalars},
        outcome=tuple(str(info.outcome) for info in infos), map=maps[-1], panel=panel, given=given,
        start_position=given.inputs.start.position,
    )  # fmt: skip


def _codes(codes: Sequence[RisCode | None]) -> Integers:
    """Phase levels (K, N, M) of one code a simulated cycle; (K, 0, 0) without a RIS panel."""
    if any(code is None for code in codes):
        return np.zeros((len(codes), 0, 0), dtype=np.int64)
    return np.array([code.index for code in codes if code is not None], dtype=np.int64)
