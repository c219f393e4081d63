"""Does Fig. 4(a) hold: optimised panel above random panel above sphere at every distance?

The agent walks below the room's diagonal, as in the paper; gains are those of the direct path over the panel, with
CRLB-GA run many times at each place and many random codes; the sphere of the panel's size takes the panel's place.
Run: `python benchmarks/gain_curves.py [--channel traced] [--places 25] [--figure FILE]`.
"""

import argparse
from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.protocol import Channel
from rislam_rt.design import GainCurves, direct_only, gain_curves, problem_from_paths
from rislam_rt.model import PathKind, RadioConfig, Scatterer, Scene, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", choices=("image", "traced"), default="traced")
    parser.add_argument("--places", type=int, default=25)
    parser.add_argument("--element", choices=("tang", "energy"), default="tang")
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    scene, rng = load_scene("scenes/paper_room"), np.random.default_rng(4)
    assert scene.ris is not None
    spec = replace(scene.ris.spec, element=arguments.element)
    panel = replace(scene.ris, spec=spec)
    scene = replace(scene, ris=panel)
    motion = walk(scene, arguments.places)
    paths = channel(arguments.channel, scene).paths(motion)
    problems = [
        direct_only(problem_from_paths(paths, motion.tx[k], motion.rx[k], RADIO, spec.levels, cycle=k))
        for k in range(len(motion))
    ]
    curves = gain_curves(problems, rng=rng)
    radius = 0.5 * spec.rows * float(spec.spacing[1])
    sphere = sphere_gain(arguments.channel, scene, motion, radius)
    distance = np.linalg.norm(motion.position - panel.center, axis=1)
    report(distance, curves, sphere, radius)
    if arguments.figure is not None:
        draw(distance, curves, sphere, radius, arguments.figure)


def walk(scene: Scene, places: int) -> Trajectory:
    """Places along the paper's track, from the corner to below the panel, at the scene's own height and baseline."""
    along = np.linspace(0.0, 1.0, places)[:, None]
    start = scene.agent.position[0]
    assert scene.ris is not None
    # the last place is 0.2 m off the nadir, where the track passes the panel
    end = np.append(scene.ris.center[:2] - 0.14, start[2])
    position = start + along * (end - start)
    return Trajectory(
        np.arange(float(places)), position, np.zeros((places, 3)), np.full(places, np.pi / 4), scene.agent.body
    )


def channel(name: str, scene: Scene) -> Channel:
    """Either channel, without wall bounces."""
    if name == "image":
        return ImageSourceChannel(scene, RADIO, 0)
    from rislam_rt.channel.traced import TracedChannel

    return TracedChannel(scene, RADIO, 0)


def sphere_gain(name: str, scene: Scene, motion: Trajectory, radius: float) -> Floats:
    """Gain (K,) [dB] of a sphere in the panel's place, its centre a radius below the ceiling's surface."""
    assert scene.ris is not None
    center = scene.ris.center + radius * scene.ris.spec.normal
    ball = Scatterer("ball", center, np.pi * radius**2, radius)
    paths = channel(name, replace(scene, scatterers=(ball,), ris=None)).paths(motion)
    return 20.0 * np.log10(np.abs(paths.gain[:, int(np.flatnonzero(paths.kind == PathKind.PS)[0])]))


def report(distance: Floats, curves: GainCurves, sphere: Floats, radius: float) -> None:
    """Table and the order of the curves."""
    print(f"{'distance m':>10s}{'optimised dB':>24s}{'exact':>9s}{'random dB':>26s}{'sphere':>9s}")
    for k in range(0, len(distance), max(len(distance) // 12, 1)):
        middle, low, high = (curve[k] for curve in curves.optimized)
        rms, least, most = (curve[k] for curve in curves.random)
        print(
            f"{distance[k]:10.2f}{middle:9.2f} [{low:6.2f},{high:6.2f}]{curves.exact[k]:9.2f}"
            f"{rms:10.2f} [{least:6.2f},{most:6.2f}]{sphere[k]:9.2f}"
        )
    apart, above = curves.optimized.low > curves.random.high, curves.optimized.low > sphere
    print(f"optimised above random codes, intervals apart, at {np.mean(apart):.0%} of places")
    print(f"optimised above the sphere of {radius} m at {np.mean(above):.0%} of places")
    print(f"random codes (rms) above the sphere at {np.mean(curves.random.middle > sphere):.0%} of places")
    print(
        f"CRLB-GA below the exact optimum by {np.median(curves.exact - curves.optimized.middle):.2f} dB in the median"
    )


def draw(distance: Floats, curves: GainCurves, sphere: Floats, radius: float, figure: str) -> None:
    """The figure."""
    import matplotlib.pyplot as plt

    image, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    axes.plot(distance, curves.exact, color="black", linestyle="--", label="certified optimum, 4 levels")
    for interval, color, label in (
        (curves.optimized, "tab:blue", "RIS, CRLB-GA"),
        (curves.random, "tab:orange", "RIS, random codes (rms)"),
    ):
        axes.plot(distance, interval.middle, color=color, label=label)
        axes.fill_between(distance, interval.low, interval.high, color=color, alpha=0.25)
    axes.plot(distance, sphere, color="tab:green", label=f"sphere of {radius:.3f} m")
    axes.set(xlabel="distance between agent and panel or sphere [m]", ylabel="gain of the direct path [dB]")
    axes.grid(alpha=0.3)
    axes.legend()
    image.savefig(figure, dpi=120)


if __name__ == "__main__":
    main()
