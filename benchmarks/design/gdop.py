"""Where in the room does the panel help, and where can it not?

The horizontal position bound over a grid of the paper's room, without a panel, with random and with optimised codes;
landmarks known, a prior of 0.5 m an axis. Above: paths without wall bounces, where sphere and panel stand alone. Below:
single bounces as well. Run:
`python benchmarks/design/gdop.py [--step 0.15] [--height 0.5] [--figure docs/figures/gdop.png]`.
"""

import argparse
import time

import numpy as np
from known_paths import design_along, position_error_map

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import PathKind, RadioConfig, RisCode, Scene, Trajectory
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene

RADIO = RadioConfig()
PRIOR_STD = 0.5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=float, default=0.15)
    parser.add_argument("--height", type=float, default=0.5)
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    scene, rng = load_scene("scenes/paper_room"), np.random.default_rng(9)
    (x0, y0, _), (x1, y1, _) = scene.bounds
    x, y = np.arange(x0 + 0.15, x1, arguments.step), np.arange(y0 + 0.15, y1, arguments.step)
    places = np.stack([*np.meshgrid(x, y, indexing="ij"), np.full((len(x), len(y)), arguments.height)], axis=-1)
    maps = {depth: bound_maps(scene, places.reshape(-1, 3), depth, rng=rng) for depth in (0, 1)}
    for depth, columns in maps.items():
        for name, bound in columns.items():
            below, spread = bound[nearest(places, scene)], np.quantile(bound, [0.5, 0.95])
            print(
                f"bounces {depth}, {name:10s} median {1e3 * spread[0]:6.1f} mm, 95 % {1e3 * spread[1]:6.1f} mm, "
                f"below the panel {1e3 * below:6.1f} mm"
            )
    if arguments.figure is not None:
        draw(scene, maps, (len(x), len(y)), arguments.figure)


def bound_maps(scene: Scene, places: Floats, depth: int, *, rng: np.random.Generator) -> dict[str, Floats]:
    """Position error bound (K,) [m] of each case."""
    assert scene.ris is not None
    count, spec = len(places), scene.ris.spec
    motion = Trajectory(
        np.arange(float(count)), places, np.zeros((count, 3)), np.zeros(count), scene.agent.body
    )  # fmt: skip
    paths = ImageSourceChannel(scene, RADIO, depth).paths(motion)
    prior = np.eye(2) / PRIOR_STD**2
    begin = time.perf_counter()
    code = design_along(paths, motion.tx, motion.rx, RADIO, spec, method="coordinate", rng=rng, prior=prior)
    print(f"bounces {depth}: {count} designs in {time.perf_counter() - begin:.2f} s")
    drawn = RisCode(rng.integers(spec.levels, size=code.index.shape), spec.levels)
    bare = paths.with_gain(np.where(np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS)), 0.0, paths.gain))
    cases = {"no panel": bare, "random": rephase(paths, drawn), "optimised": rephase(paths, code)}
    return {
        name: position_error_map(case, motion.tx, motion.rx, RADIO, prior=prior).rms for name, case in cases.items()
    }


def nearest(places: Floats, scene: Scene) -> int:
    """The place nearest to the panel's nadir."""
    assert scene.ris is not None
    return int(np.argmin(np.linalg.norm(places.reshape(-1, 3)[:, :2] - scene.ris.center[:2], axis=1)))


def draw(scene: Scene, maps: dict[int, dict[str, Floats]], shape: tuple[int, int], figure: str) -> None:
    """Six maps on one scale."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    assert scene.ris is not None
    (x0, y0, _), (x1, y1, _) = scene.bounds
    image, grid = plt.subplots(2, 3, figsize=(9.6, 6.4), layout="constrained", sharex=True, sharey=True)
    for row, (depth, columns) in zip(grid, maps.items(), strict=True):
        for axes, (name, bound) in zip(row, columns.items(), strict=True):
            shown = axes.imshow(
                1e3 * bound.reshape(shape).T, origin="lower", extent=(x0, x1, y0, y1), norm=LogNorm(3, 800),
                cmap="viridis_r",
            )  # fmt: skip
            axes.plot(*scene.ris.center[:2], "s", color="white", markeredgecolor="black", label="panel")
            for scatterer in scene.scatterers:
                axes.plot(*scatterer.position[:2], "o", color="white", markeredgecolor="black", label=scatterer.name)
            axes.set_title(f"{name}, {'no bounces' if depth == 0 else 'single bounces'}")
    grid[0, 0].legend(loc="upper left")
    for axes in grid[1]:
        axes.set_xlabel("x [m]")
    for axes in grid[:, 0]:
        axes.set_ylabel("y [m]")
    image.colorbar(shown, ax=grid, label="position error bound [mm]", shrink=0.8)
    image.savefig(figure, dpi=110)


if __name__ == "__main__":
    main()
