"""Why do codes designed with the paper's gradient lose the panel's direct path in a run? A table, in Markdown.

The reference run of `pipelines/ablations.toml` on the image-source channel; on every tenth predicted belief that knows
the panel, codes by every form of the gradient, several searches and numbers of levels. What each search misses of its
own objective, what its code costs in the exact one, and what the true direct path gets.
Run: `python benchmarks/design/gradient_in_runs.py [--seeds 7 8] [--every 10]`.
"""

import argparse
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple, get_args

import numpy as np

from rislam_rt.arrays import Complexes
from rislam_rt.design import DESIGNERS, DesignConfig, build_objective, exact_code, problem_from_belief
from rislam_rt.information import GradientMode, Outcome
from rislam_rt.model import RadioConfig, RisSpec, SlamEstimate
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.run import prepare_setup, run_scheme
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.progress import tell_nobody
from rislam_rt.ris import leg_response
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_pipeline, find_room
from rislam_rt.studies.swept.cell import cell_spec

MODES: tuple[GradientMode, ...] = get_args(GradientMode)
THOROUGH = DesignConfig(starts=11, certify=False)
"""Descents from the optima of the direct path and of both paths over each of the five walls."""
CASES = (
    ("genetic", DesignConfig(certify=False), 4), ("genetic, 1000 iterations", DesignConfig(iterations=1000), 4),
    ("coordinate", THOROUGH, 4), ("exact", THOROUGH, 4), ("coordinate", THOROUGH, 2), ("coordinate", THOROUGH, 16),
)  # fmt: skip
HEARD_DB = 10.0
"""SNR over all antennas at which a receiver hears a path every other time."""
HEAD = (
    "gradient", "design", "levels", "own objective above the best of 11 descents [%]", "exact CRLB above the best [%]",
    "direct path below its optimum [dB]", "heard [%]",
)  # fmt: skip


class Row(NamedTuple):
    """One code on one belief."""

    own: float
    """Excess of the objective that it was designed with, percent."""
    exact: float
    """Excess of the CRLB with the exact gradient, over the best code with four levels, percent."""
    below_db: float
    """Gain of the true direct path under its optimum with four levels."""
    snr_db: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[7, 8])
    parser.add_argument("--every", type=int, default=10, help="cycles from belief to belief")
    options = parser.parse_args()
    rows: dict[tuple[str, str, int], list[Row]] = {}
    for seed in options.seeds:
        for number, (belief, direct, ris, radio) in enumerate(beliefs(seed, options.every)):
            for key, row in codes(belief, direct, ris, radio, np.random.default_rng([seed, number])):
                rows.setdefault(key, []).append(row)
    print(f"{len(next(iter(rows.values())))} beliefs; medians, in brackets the 95 % point\n")
    print("| " + " | ".join(HEAD) + " |\n|" + " --- |" * len(HEAD))
    for (mode, name, levels), found in rows.items():
        own, exact, below, snr = np.array(found).T
        shown = [f"{np.median(one):.1f} ({np.quantile(one, 0.95):.1f})" for one in (own, exact, below)]
        print(f"| {mode} | {name} | {levels} | {' | '.join(shown)} | {100.0 * np.mean(snr > HEARD_DB):.0f} |")


def beliefs(seed: int, every: int) -> Iterator[tuple[SlamEstimate, Complexes, RisSpec, RadioConfig]]:
    """Predicted beliefs of the reference run that hold the panel, with the true direct path's response (N M,)."""
    content = tomllib.loads(find_pipeline("ablations").read_text())
    spec = cell_spec({"run": content["run"] | {"channel": "image_source"}, "variants": {}})
    scene, radio = load_scene(find_room("paper_room")), build_settings(spec).radio
    setup = prepare_setup(scene, spec, rng=np.random.default_rng(seed))
    held: list[SlamEstimate] = []

    def predict(*arguments: Any) -> SlamEstimate:
        held.append(ESTIMATORS["slam"].predict(*arguments))
        return held[-1]

    run_scheme("optimized", setup, spec, tell_nobody, ESTIMATORS["slam"]._replace(predict=predict))
    panel, motion = scene.panels[0], setup.scene.agent
    for cycle in range(0, len(held), every):
        if held[cycle].map.ris >= 0:
            ends = (motion.tx[cycle], motion.rx[cycle])
            one = np.ones((), dtype=np.complex128)
            legs = [leg_response(panel.spec, panel.center, end, one, radio.wavelength) for end in ends]
            yield held[cycle], (legs[0] * legs[1]).ravel(), panel.spec, radio


def codes(
    belief: SlamEstimate, direct: Complexes, ris: RisSpec, radio: RadioConfig, rng: np.random.Generator
) -> Iterator[tuple[tuple[str, str, int], Row]]:
    """Codes for one belief by every form of the gradient and every search."""
    at_most = exact_code(direct, ris.levels)[1]
    exact = problem_from_belief(belief, ris, radio, samples=1)
    assert exact is not None
    least = DESIGNERS["coordinate"](exact, rng=rng, config=THOROUGH).crlb
    for mode in MODES:
        problem = problem_from_belief(belief, ris, radio, samples=1, gradient=mode)
        assert problem is not None
        best = {
            levels: DESIGNERS["coordinate"](replace(problem, levels=levels), rng=rng, config=THOROUGH).crlb
            for levels in {levels for *_, levels in CASES}
        }
        for name, config, levels in CASES:
            one = replace(problem, levels=levels)
            design = DESIGNERS[name.split(",")[0]](one, rng=rng, config=config)
            assert design.outcome is Outcome.OK
            worth = float(build_objective(replace(exact, levels=levels)).of_index(design.code.index.ravel()))
            gain = np.abs(np.exp(-1j * design.xi.ravel()) @ direct)
            snr = float(radio.integrated_snr(gain))
            excess = (100.0 * (design.crlb / best[levels] - 1.0), 100.0 * (worth / least - 1.0))
            yield (mode, name, levels), Row(*excess, float(20.0 * np.log10(at_most / gain)), 10.0 * np.log10(snr))


if __name__ == "__main__":
    main()
