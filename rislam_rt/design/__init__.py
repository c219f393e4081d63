"""Floor 5: design of the RIS panel's phase code. Designers, bounds, and the design problem on the agent's belief."""

from rislam_rt.design.beam_sweep import BeamSweep
from rislam_rt.design.design_problem import DesignProblem, problem_from_arrays
from rislam_rt.design.design_result import Design, DesignConfig
from rislam_rt.design.designers import DESIGNERS, designer
from rislam_rt.design.gain_curves import GainCurves, direct_only, gain_curves
from rislam_rt.design.genie import focus_codes, panel_columns, problem_from_paths
from rislam_rt.design.objective import Objective, build_objective
from rislam_rt.design.problem_from_belief import design_code, problem_from_belief
from rislam_rt.design.single_path import continuous_phases, exact_code, nearest_code

__all__ = [
    "DESIGNERS", "BeamSweep", "Design", "DesignConfig", "DesignProblem", "GainCurves", "Objective", "build_objective",
    "continuous_phases", "design_code", "designer", "direct_only", "exact_code", "focus_codes", "gain_curves",
    "nearest_code", "panel_columns", "problem_from_arrays", "problem_from_belief", "problem_from_paths",
]  # fmt: skip
