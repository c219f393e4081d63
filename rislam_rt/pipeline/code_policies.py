"""Code policies: how schemes choose the panel's phase code, from the predicted belief or, for the genie, from truth."""

from collections.abc import Callable

import numpy as np

from rislam_rt.design import BeamSweep, design_code, designer, problem_from_paths
from rislam_rt.errors import ConfigError
from rislam_rt.information import prior_from_covariance
from rislam_rt.model import DataSheet, RisCode, SlamEstimate
from rislam_rt.pipeline.assumed_model import AssumedModel
from rislam_rt.pipeline.cycle import CodePolicy, GroundTruth
from rislam_rt.pipeline.own_methods import fresh_own, is_own, own_code
from rislam_rt.pipeline.schemes import Scheme
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, Settings


def build_designer(
    scheme: Scheme, panel: DataSheet, spec: PipelineSpec, settings: Settings, told: AssumedModel
) -> CodePolicy:
    """Code policy of a scheme with a RIS panel: designs on the agent's belief, or on the true paths for the genie.

    The true `panel` and `settings` serve the genie alone.
    """
    method = spec.design.method if scheme.method == "spec" else str(scheme.method)
    return _on_truth(method, panel, spec, settings) if scheme.on_truth else _on_belief(method, spec, told)


def _on_belief(method: str, spec: PipelineSpec, told: AssumedModel) -> CodePolicy:
    """Code policy that designs each phase code on the agent's predicted belief alone."""
    section, panel, settings = spec.design, told.panel, told.settings
    assert panel is not None
    sweep = BeamSweep()
    own = fresh_own(method) if is_own(method) else None

    def choose(
        belief: Callable[[], SlamEstimate], cycle: int, room: GroundTruth, *, rng: np.random.Generator
    ) -> RisCode:
        if method == "random":  # looks at no belief
            return RisCode(rng.integers(panel.levels, size=(panel.rows, panel.cols)), panel.levels)
        if own is not None:
            return own_code(method, belief(), panel, settings.radio, rng=rng, designer=own)
        return design_code(
            belief(), panel, settings.radio, method=method, rng=rng, samples=section.samples, config=settings.design,
            landmark_uncertainty=section.landmark_uncertainty, least_snr=section.least_snr,
            gradient=section.gradient, sweep=sweep,
        ).code  # fmt: skip

    return choose


def _on_truth(method: str, panel: DataSheet, spec: PipelineSpec, settings: Settings) -> CodePolicy:
    """Code policy of the genie: designs on the true paths of the cycle of the code's use, with the belief's prior."""

    def choose(
        belief: Callable[[], SlamEstimate], cycle: int, room: GroundTruth, *, rng: np.random.Generator
    ) -> RisCode:
        due = min(cycle + spec.control.delay_cycles, len(room.trajectory) - 1)
        prior = prior_from_covariance(belief().covariance[:2, :2])
        there = room.trajectory[due : due + 1]
        try:
            problem = problem_from_paths(
                room.at(due), there.tx[0], there.rx[0], settings.radio, panel.levels, prior=prior,
                least_snr=spec.design.least_snr,
            )  # fmt: skip
        except ConfigError:  # the panel is out of sight: any code will do
            return RisCode(rng.integers(panel.levels, size=(panel.rows, panel.cols)), panel.levels)
        return designer(method)(problem, rng=rng, config=settings.design).code

    return choose
