"""What does alternating the code do under the panel, where the ceiling's return hides it?

The agent stands at the last places before the nadir of the paper's panel, the panel focused on it, the ceiling about
9 dB stronger. Per place: how often the panel's path is found, and the error of its delay, as a multiple of the bound
that it would have alone; once with the code held, once alternated with its phase-reversed twin at the same energy.
Run: `python benchmarks/receiver/nadir.py [--channel image] [--trials 100] [--snr 0] [--figure FILE]`.
"""

import argparse
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.protocol import Channel
from rislam_rt.design import focus_codes
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import PathKind, Paths, RadioConfig, Scene, Trajectory
from rislam_rt.scene import load_scene

RADII = np.array([0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9, 1.1, 1.4, 1.8])
"""Horizontal distances of the agent's midpoint from the nadir [m]."""
HEADING = 0.3


class Outcome(NamedTuple):
    """Per place."""

    found: Floats
    error: Floats
    """Median |error| of the delay over that of a normal error at the single-path bound."""
    rms: Floats
    """RMS error over the single-path bound."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", choices=("image", "traced"), default="traced")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--snr", type=float, default=0.0, help="of the paper's sphere at 3 m, over all antennas [dB]")
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    radio = with_reference_snr(RadioConfig(), arguments.snr)
    paths = focused(scene, channel(arguments.channel, scene, radio))
    panel = int(np.flatnonzero(paths.kind == PathKind.RIS)[0])
    ceiling = next(p for p in range(paths.num_paths) if paths.label(p) == "VT ceiling")
    snr = 10.0 * np.log10(radio.integrated_snr(paths.gain[:, [panel, ceiling]]))
    gap = (paths.tau[:, panel] - paths.tau[:, ceiling]) * radio.bandwidth
    held = run(paths, panel, radio, False, arguments.trials)
    alternated = run(paths, panel, radio, True, arguments.trials)
    print(
        "place [m], gap [c/B], SNR panel and ceiling [dB] | held: found, RMS / bound | alternated: found, RMS / bound"
    )
    for k, radius in enumerate(RADII):
        print(
            f"{radius:5.2f}  {gap[k]:5.2f}  {snr[k, 0]:5.1f} {snr[k, 1]:5.1f} | {held.found[k]:4.2f} {held.rms[k]:8.2f}"
            f" | {alternated.found[k]:4.2f} {alternated.rms[k]:5.2f}"
        )
    if arguments.figure is not None:
        draw(gap, held, alternated, arguments.figure)


def channel(name: str, scene: Scene, radio: RadioConfig) -> Channel:
    if name == "image":
        return ImageSourceChannel(scene, radio)
    from rislam_rt.channel.traced import TracedChannel

    return TracedChannel(scene, radio)


def focused(scene: Scene, tracer: Channel) -> Paths:
    """Paths at the places, the panel set to the best code of its direct path."""
    assert scene.ris is not None
    direction = np.array([np.cos(2.2), np.sin(2.2)])
    height = scene.agent.position[0, 2]
    places = np.column_stack([scene.ris.center[:2] + RADII[:, None] * direction, np.full(len(RADII), height)])
    still = np.zeros_like(places)
    motion = Trajectory(np.arange(float(len(places))), places, still, np.full(len(places), HEADING), scene.agent.body)
    paths = tracer.paths(motion)
    return tracer.respond(paths, focus_codes(paths, scene.ris.spec.levels))


def run(paths: Paths, panel: int, radio: RadioConfig, alternation: bool, trials: int) -> Outcome:
    config = ReceiverConfig(estimator="waveform", alternation=alternation, false_alarm_rate=0.01)
    bound = 1.0 / np.sqrt(
        8.0 * np.pi**2 * radio.effective_bandwidth_squared * radio.integrated_snr(paths.gain[:, panel])
    )
    found, middle, rms = [], [], []
    for place in range(paths.num_cycles):
        rng = np.random.default_rng(place)
        errors = []
        for _ in range(trials):
            measurement, truth = measure(paths, place, HEADING, radio, config, rng=rng)
            row = np.flatnonzero(truth.path == panel)
            if len(row):
                errors.append(measurement.tau[row[0]] - paths.tau[place, panel])
        table = np.abs(errors) / bound[place]
        found.append(len(errors) / trials)
        middle.append(np.median(table) / 0.6745 if errors else np.inf)
        rms.append(np.sqrt(np.mean(table**2)) if errors else np.inf)
    return Outcome(np.array(found), np.array(middle), np.array(rms))


def draw(gap: Floats, held: Outcome, alternated: Outcome, file: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    for outcome, name in ((held, "code held"), (alternated, "code alternated with its twin")):
        left.plot(RADII, outcome.found, "o-", label=name)
        right.plot(RADII, np.where(np.isfinite(outcome.rms), outcome.rms, np.nan), "o-", label=name)
    one_cell = np.interp(1.0, gap, RADII)
    for axes in (left, right):
        axes.axvline(one_cell, color="0.8", linestyle="--")
        axes.set(xlabel="distance from the nadir [m]")
    left.set(title="Share in which the panel is found", ylim=(-0.03, 1.03))
    left.annotate(" panel and ceiling c/B apart", (one_cell, 0.1), color="0.4")
    left.legend(frameon=False, loc="center right")
    right.set(title="Delay error where found: RMS / single-path bound", ylim=(0.0, None))
    right.axhline(1.5, color="0.6", linestyle=":")
    right.annotate("1.5", (0.0, 1.6), color="0.4")
    figure.savefig(file, dpi=130)


if __name__ == "__main__":
    main()
