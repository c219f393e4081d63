"""Time budget of a cycle: whether its four steps fill the scene's cycle, and the settings under which they do."""

from rislam_rt.pipeline.specification.pipeline_spec import BudgetSection

SAME_CYCLE = 0.01
"""Largest relative difference between the scene's cycle time and the sum of the time budget: clocks are inexact."""
DIGITS = 4
"""Significant digits of a proposed step: its rounding is a hundredth of what the sum may differ by."""


def total_seconds(budget: BudgetSection) -> float:
    """Sum [s] of the four steps of a time budget."""
    return budget.optimise_s + budget.communicate_s + budget.measure_s + budget.localise_s


def fills_cycle(budget: BudgetSection, cycle: float) -> bool:
    """Whether the four steps of a time budget sum to a scene's cycle time [s], but for `SAME_CYCLE` of it."""
    return abs(total_seconds(budget) - cycle) <= SAME_CYCLE * cycle


def fitted_steps(budget: BudgetSection, cycle: float, measure_s: float | None = None) -> dict[str, float]:
    """Steps [s], by name, that sum to a scene's cycle time [s]: those of a time budget, scaled alike if they do not sum
    to it. `measure_s` [s], if given, is the measurement's; what is left goes to the localisation."""
    scale = 1.0 if fills_cycle(budget, cycle) else cycle / (total_seconds(budget) or 1.0)
    steps = {name: float(f"{scale * value:.{DIGITS}g}") for name, value in budget.model_dump().items()}
    steps["measure_s"] = steps["measure_s"] if measure_s is None else measure_s
    rest = round(cycle - steps["optimise_s"] - steps["communicate_s"] - steps["measure_s"], 12)
    return steps | {"localise_s": max(float(f"{rest:.{DIGITS}g}"), 0.0)}


def changed_steps(budget: BudgetSection, steps: dict[str, float]) -> str:
    """Options of the command line that change a time budget to other steps [s]: `--set budget.measure_s=0.004 ...`."""
    return " ".join(f"--set budget.{name}={s:g}" for name, s in steps.items() if s != getattr(budget, name))
