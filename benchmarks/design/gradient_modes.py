"""What do the paper's path gradients change? A table, in Markdown, over random places of the paper's room.

For every path class: the horizontal gradient's length in every mode and its angle to the exact one; then the
position bound that each mode promises, and what a code designed with it is worth under the exact one.
Run: `python benchmarks/design/gradient_modes.py [--places 300]`.
"""

import argparse
from dataclasses import replace
from typing import get_args

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import DESIGNERS, DesignProblem, build_objective, problem_from_paths
from rislam_rt.information import GradientMode, vertex_gradient
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()
MODES: tuple[GradientMode, ...] = get_args(GradientMode)
DEPTH = 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=300)
    places = parser.parse_args().places
    scene, rng = load_scene("scenes/paper_room"), np.random.default_rng(5)
    position, still = rng.uniform([0.4, 0.4, 0.2], [5.6, 5.6, 1.4], size=(places, 3)), np.zeros((places, 3))
    motion = Trajectory(np.arange(float(places)), position, still, rng.uniform(-3, 3, places), scene.agent.body)
    paths = ImageSourceChannel(scene, RADIO, DEPTH).paths(motion)
    walls = (paths.tx_walls >= 0).sum(axis=1)
    gradient = {
        mode: vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices, mode=mode, landmark=walls)
        for mode in MODES
    }
    gradient = {mode: found[..., :2] for mode, found in gradient.items()}
    print_classes(paths, gradient)
    print_designs(paths, motion, gradient, rng=rng)


def print_classes(paths: Paths, gradient: dict[GradientMode, Floats]) -> None:
    """Medians a class; walls on the Rx leg and on the Tx leg apart."""
    print("| class | " + " | ".join(MODES) + " | " + " | ".join(f"angle {mode} [deg]" for mode in MODES[1:]) + " |")
    print("|" + " --- |" * (2 * len(MODES)))
    tx_side = paths.tx_walls[:, 0] >= 0
    for kind in PathKind:
        sides = {f"{kind.name}": np.ones(paths.num_paths, dtype=bool)}
        if kind in (PathKind.VS, PathKind.VRIS):
            sides = {f"{kind.name}, wall on the Rx leg": ~tx_side, f"{kind.name}, wall on the Tx leg": tx_side}
        for name, side in sides.items():
            use = paths.valid & (paths.kind == kind) & side
            lengths = [np.median(np.linalg.norm(gradient[mode][use], axis=-1)) for mode in MODES]
            angles = [np.median(angle_between_lines(gradient[mode][use], gradient["exact"][use])) for mode in MODES[1:]]
            shown = ["-" if not lengths[0] else f"{np.degrees(angle):.0f}" for angle in angles]
            print(f"| {name} | {' | '.join(f'{length:.3f}' for length in lengths)} | {' | '.join(shown)} |")


def angle_between_lines(a: Floats, b: Floats) -> Floats:
    """Angle [rad] between directions (..., 2) up to sign, which g g^T does not see."""
    return np.arctan2(np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]), np.abs(np.sum(a * b, axis=-1)))


def print_designs(
    paths: Paths, motion: Trajectory, gradient: dict[GradientMode, Floats], *, rng: np.random.Generator
) -> None:
    """Codes designed with each mode's gradients, valued with that mode's and with the exact ones."""
    promised: dict[GradientMode, list[float]] = {mode: [] for mode in MODES}
    worth: dict[GradientMode, list[float]] = {mode: [] for mode in MODES}
    for k in range(paths.num_cycles):
        exact = problem_from_paths(paths, motion.tx[k], motion.rx[k], RADIO, 4, cycle=k, prior=np.eye(2) / 0.5**2)
        order = column_order(paths, k)
        for mode in MODES:
            problem: DesignProblem = replace(exact, gradient=gradient[mode][k, order][None])
            design = DESIGNERS["coordinate"](problem, rng=rng)
            promised[mode].append(design.crlb)
            worth[mode].append(float(build_objective(exact).of_index(design.code.index.ravel())))
    print()
    print("| design with | bound it promises, median [mm] | exact bound of its code, median [mm] | loss in CRLB [%] |")
    print("| --- | --- | --- | --- |")
    best = np.array(worth["exact"])
    for mode in MODES:
        loss = 100 * (np.median(np.array(worth[mode]) / best) - 1)
        print(
            f"| {mode} | {1e3 * np.sqrt(np.median(promised[mode])):.1f} | {1e3 * np.sqrt(np.median(worth[mode])):.1f} "
            f"| {loss:.1f} |"
        )


def column_order(paths: Paths, cycle: int) -> np.ndarray:
    """Columns in the order of `problem_from_paths`: direct panel path, other panel paths, the rest."""
    here, kind = paths.valid[cycle], paths.kind
    groups = [(PathKind.RIS,), (PathKind.VRIS,), (PathKind.PS, PathKind.VS)]
    return np.concatenate([np.flatnonzero(here & np.isin(kind, group)) for group in groups])


if __name__ == "__main__":
    main()
