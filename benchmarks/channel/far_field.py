"""How wrong is the far-field form of the panel's gain at a distance, and how long does re-phasing a trajectory take?

Far field (Appendix A) against element-wise (eq. `single`, exact for point elements) for square panels of the paper's
elements: a beam steered by the far-field form's own phases, and random codes. Re-phasing: the paper's room, all
cycles, one code and one code a cycle; what comes out is compared with the sums of a second trace, path by path.
Run: `python benchmarks/channel/far_field.py [--figure docs/figures/far_field.png] [--no-rephase]`.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Paths, RadioConfig, RisCode, RisSpec
from rislam_rt.ris import far_field_response, leg_response, rephase
from rislam_rt.scene import load_scene

SIDES = (6, 10, 16, 32)
ANGLES = (0.0, 45.0)
"""[deg] from the panel's normal, in the plane through its diagonal, where it is longest."""
BASELINE = 0.1
"""[m] between Tx and Rx, across the line of sight."""
RADIO = RadioConfig()


class Curve(NamedTuple):
    """Errors (D,) of the far-field form at distances (D,) [m] from a panel."""

    side: int
    angle: float
    limit: float
    """2 D^2 / lambda [m]."""
    beam: Floats
    """[dB] gain by the far-field form over the element-wise gain, beam at the agent."""
    random: Floats
    """[dB] rms error over rms gain, random codes."""


def main() -> None:
    """Print both tables; with `--figure`, draw the errors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figure", default=None)
    parser.add_argument("--codes", type=int, default=400)
    parser.add_argument("--no-rephase", action="store_true")
    arguments = parser.parse_args()
    distance = np.geomspace(0.3, 100.0, 121)
    rng = np.random.default_rng(3)
    curves = [far_field_errors(side, angle, distance, arguments.codes, rng=rng) for angle in ANGLES for side in SIDES]
    report_errors(distance, curves)
    if arguments.figure is not None:
        draw(distance, curves, arguments.figure)
    if not arguments.no_rephase:
        report_rephasing()


def far_field_errors(side: int, angle: float, distance: Floats, codes: int, *, rng: np.random.Generator) -> Curve:
    """Both forms of the gain of a `side` x `side` panel for an agent at the distances (D,), [deg] off the normal."""
    panel = load_scene("scenes/paper_room").ris
    assert panel is not None
    spec = replace(panel.spec, rows=side, cols=side)
    tilt, across = np.radians(angle), (spec.right - spec.up) / np.sqrt(2.0)
    away = np.cos(tilt) * spec.normal + np.sin(tilt) * (spec.right + spec.up) / np.sqrt(2.0)
    middle = distance[:, None] * away
    near, far = (gains(form, spec, middle, across) for form in (leg_response, far_field_response))
    beam = np.exp(-1j * np.angle(far))
    code = np.exp(2j * np.pi / spec.levels * rng.integers(spec.levels, size=(codes, spec.num_elements)))
    exact, approximate = near @ code.T, far @ code.T
    return Curve(
        side,
        angle,
        2.0 * spec.diagonal**2 / RADIO.wavelength,
        20.0 * np.log10(np.abs((far * beam).sum(axis=1)) / np.abs((near * beam).sum(axis=1))),
        10.0 * np.log10(np.mean(np.abs(approximate - exact) ** 2, axis=1) / np.mean(np.abs(exact) ** 2, axis=1)),
    )


def gains(form: Callable[..., Complexes], spec: RisSpec, middle: Floats, across: Floats) -> Complexes:
    """Element gains (D, N M) between Tx and Rx on both sides of the agent's place (D, 3)."""
    legs = [
        form(spec, np.zeros(3), middle + sign * 0.5 * BASELINE * across, np.ones(len(middle)), RADIO.wavelength)
        for sign in (1.0, -1.0)
    ]
    return (legs[0] * legs[1]).reshape(len(middle), -1)


def report_errors(distance: Floats, curves: list[Curve]) -> None:
    """One row a panel and angle: errors at multiples of the limit."""
    factors = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)
    print("far-field gain over element-wise gain [dB], beam at the agent | random codes: rms error over rms gain [dB]")
    print(f"{'panel':>8s}{'angle':>7s}{'limit m':>9s}" + "".join(f"{f:8g}" for f in factors) + "  | at 1x limit")
    for curve in curves:
        at = np.interp(np.log([f * curve.limit for f in factors]), np.log(distance), curve.beam)
        seen = [
            f"{a:8.3f}" if distance[0] <= f * curve.limit <= distance[-1] else f"{'-':>8s}"
            for a, f in zip(at, factors, strict=True)
        ]
        random = float(np.interp(np.log(curve.limit), np.log(distance), curve.random))
        print(f"{curve.side:4d} x{curve.side:2d}{curve.angle:7g}{curve.limit:9.2f}{''.join(seen)}  | {random:7.2f}")


def report_rephasing(repeats: int = 15) -> None:
    """Median time of a code change over the whole trajectory, and what a second trace says."""
    scene = load_scene("scenes/paper_room")
    assert scene.ris is not None
    rng = np.random.default_rng(5)
    shape = scene.ris.spec.rows, scene.ris.spec.cols
    print(f"\nre-phasing {len(scene.agent)} cycles: median (least) of {repeats} in ms")
    for depth in (1, 2, 3):
        paths, again = (ImageSourceChannel(scene, RADIO, depth).paths(scene.agent) for _ in range(2))
        times = {}
        for name, size in (("one code", shape), ("a code a cycle", (len(scene.agent), *shape))):
            spent = []
            for _ in range(repeats):
                code = RisCode(rng.integers(4, size=size), 4)
                start = time.perf_counter()
                changed = rephase(paths, code)
                spent.append(1e3 * (time.perf_counter() - start))
            times[name] = f"{name} {np.median(spent):6.1f} ({min(spent):5.1f})"
        error = largest_difference(changed, again, code)
        print(f"depth {depth}: {paths.num_paths:4d} paths, {'; '.join(times.values())}; second trace: {error:.1e}")


def largest_difference(changed: Paths, traced: Paths, code: RisCode) -> float:
    """Largest difference of gain, over the largest gain, from the plain sum over elements of other paths."""
    assert traced.ris is not None
    worst = largest = 0.0
    for path in np.flatnonzero(traced.ris.tx_leg >= 0):
        legs = traced.ris.tx[:, traced.ris.tx_leg[path]] * traced.ris.rx[:, traced.ris.rx_leg[path]]
        plain = np.where(traced.valid[:, path], (legs * np.exp(-1j * code.xi)).sum(axis=(1, 2)), 0.0)
        worst = max(worst, float(np.abs(changed.gain[:, path] - plain).max()))
        largest = max(largest, float(np.abs(plain).max()))
    return worst / largest


def draw(distance: Floats, curves: list[Curve], figure: str) -> None:
    """Errors against distance, a colour a panel, with each panel's limit."""
    import matplotlib.pyplot as plt

    image, (left, right) = plt.subplots(1, 2, figsize=(12.4, 4.2), layout="constrained")
    colours = dict(zip(SIDES, ("#0072B2", "#D55E00", "#009E73", "#CC79A7"), strict=True))
    for curve in curves:
        style = {"color": colours[curve.side], "linestyle": "-" if curve.angle == 0.0 else "--"}
        label = f"{curve.side} x {curve.side}" if curve.angle == 0.0 else None
        left.plot(distance, curve.beam, label=label, **style)
        right.plot(distance, curve.random, label=label, **style)
        for axes in (left, right):
            axes.axvline(curve.limit, color=style["color"], linewidth=1.0, linestyle=":")
    for axes in (left, right):
        axes.plot([], [], color="black", linestyle="--", label=f"agent {ANGLES[1]:g}° off the normal")
        axes.plot([], [], color="black", linewidth=1.0, linestyle=":", label="$2 D^2 / \\lambda$")
        axes.set(xscale="log", xlabel="distance from the panel [m]", xlim=(distance[0], distance[-1]))
        axes.set_xticks([0.3, 1, 3, 10, 30, 100], ["0.3", "1", "3", "10", "30", "100"])
        axes.grid(color="#e3e3e3")
        axes.spines[["top", "right"]].set_visible(False)
    left.set(yscale="log", ylim=(0.003, 30.0), ylabel="far-field gain over element-wise gain [dB]")
    left.set_title("Beam at the agent, phases of the far-field form", loc="left", fontsize=11)
    right.set(ylim=(-45.0, 5.0), ylabel="error of the gain over the gain, both rms [dB]")
    right.set_title("Random codes", loc="left", fontsize=11)
    left.set_yticks([0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30], ["0.01", "0.03", "0.1", "0.3", "1", "3", "10", "30"])
    image.legend(*left.get_legend_handles_labels(), loc="outside right center", frameon=False)
    image.savefig(figure, dpi=120)


if __name__ == "__main__":
    main()
