"""What does the receiver make of the paper's room, all classes of paths at once?

At places along the paper's track, the panel focused on the agent, three noise levels. Per class: share of paths found
against their SNR, false components against the set rate, and errors over the reported deviations and over the bound
that a path has alone, for the waveform estimator and for the bound-driven receiver in both resolutions. Run:
`python benchmarks/receiver/room.py [--channel image] [--places 60] [--figure FILE]`.
"""

import argparse
import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.protocol import Channel
from rislam_rt.design import focus_codes
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.measurement import ReceiverConfig, detection_probability, measure, receive, with_reference_snr
from rislam_rt.model import PathKind, Paths, RadioConfig, Scene, Trajectory
from rislam_rt.scene import load_scene

REFERENCES_DB = (0.0, 13.0, 30.0)
"""SNR of the paper's sphere at 3 m, over all antennas."""
RATES = (0.01, 0.1, 0.5, 1.47)
"""Set false alarms a cycle; the last is what a threshold of 10 dB stands for."""
BINS_DB = np.arange(0.0, 41.0, 2.5)
RECEIVERS = {
    "waveform": ReceiverConfig(estimator="waveform", clutter_rate=0.0, alternation=False),
    "bound, joint": ReceiverConfig(estimator="bound", resolution="joint", clutter_rate=0.0, alternation=False),
    "bound, cell": ReceiverConfig(estimator="bound", resolution="cell", clutter_rate=0.0, alternation=False),
}


class Findings(NamedTuple):
    """Components of all cycles of a run, and all paths that could have been found."""

    kind: Integers
    """(N,) class of each identified component."""
    error: Floats
    """(N, 3) of delay [c/B] and cosines."""
    deviation: Floats
    """(N, 3) as reported."""
    lone: Floats
    """(N, 3) bound that the path would have alone."""
    offered_snr: Floats
    """(Q,) SNR [dB] of every path heard."""
    offered_kind: Integers
    offered_alone: Floats
    """(Q,) distance [cells] to the nearest path at least as strong less 10 dB."""
    offered_found: Floats
    false: float
    """False components a cycle."""
    seconds: float
    """A cycle, processor time."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", choices=("image", "traced"), default="traced")
    parser.add_argument("--places", type=int, default=60)
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    motion = places(scene, arguments.places)
    paths = focused(scene, channel(arguments.channel, scene), motion)
    findings = {}
    for name, config in RECEIVERS.items():
        runs = [
            run(paths, motion, with_reference_snr(RadioConfig(), snr), config, seed)
            for seed, snr in enumerate(REFERENCES_DB)
        ]
        findings[name] = runs
        for snr, found in zip(REFERENCES_DB, runs, strict=True):
            report(f"{name}, sphere at {snr:.0f} dB", found)
    compare(findings["waveform"], findings["bound, joint"])
    print("false components a cycle: set, waveform in the room, waveform on noise alone")
    rates = np.array([false_rates(paths, motion, rate) for rate in RATES])
    for rate, (room, noise) in zip(RATES, rates, strict=True):
        print(f"{rate:5.2f}  {room:5.2f}  {noise:5.2f}")
    if arguments.figure is not None:
        draw(findings, rates, arguments.figure)


def channel(name: str, scene: Scene) -> Channel:
    if name == "image":
        return ImageSourceChannel(scene, RadioConfig())
    from rislam_rt.channel.traced import TracedChannel

    return TracedChannel(scene, RadioConfig())


def places(scene: Scene, count: int) -> Trajectory:
    """Evenly along the paper's track."""
    rows = np.linspace(0, len(scene.agent) - 1, count).astype(int)
    agent = scene.agent
    return Trajectory(agent.time[rows], agent.position[rows], agent.velocity[rows], agent.heading[rows], agent.body)


def focused(scene: Scene, tracer: Channel, motion: Trajectory) -> Paths:
    """Paths with the panel set, in every cycle, to the best code of its direct path."""
    paths = tracer.paths(motion)
    assert scene.ris is not None
    return tracer.respond(paths, focus_codes(paths, scene.ris.spec.levels))


def run(paths: Paths, motion: Trajectory, radio: RadioConfig, config: ReceiverConfig, seed: int) -> Findings:
    rng = np.random.default_rng(seed)
    rows: list[Any] = []
    offered: list[Any] = []
    false, seconds = 0, 0.0
    cells = np.array([radio.bandwidth, radio.array.rows * radio.array.spacing, radio.array.cols * radio.array.spacing])
    for cycle in range(paths.num_cycles):
        heading = float(motion.heading[cycle])
        begin = time.process_time()
        measurement, truth = measure(paths, cycle, heading, radio, config, rng=rng)
        seconds += time.process_time() - begin
        received = receive(paths, cycle, heading, radio, config)
        snr = 10.0 * np.log10(radio.integrated_snr(received.gain))
        place = np.column_stack([received.tau, received.direction[:, :2]]) * cells
        apart = np.linalg.norm(place[:, None] - place, axis=-1)
        rivals = (snr > snr[:, None] - 10.0) & ~np.eye(len(snr), dtype=bool)
        alone = np.min(np.where(rivals, apart, np.inf), axis=1, initial=np.inf)
        offered.append(np.column_stack([snr, paths.kind[received.path], alone, np.isin(received.path, truth.path)]))
        known = truth.path >= 0
        false += int(np.sum(~known))
        path = truth.path[known]
        cosines = (paths.arrival[cycle] @ rotation_z(motion.heading[cycle]))[path, :2]
        error = np.column_stack([measurement.tau[known] - paths.tau[cycle, path], measurement.cosines[known] - cosines])
        deviation = np.column_stack([measurement.tau_std, measurement.cosines_std])[known]
        power = radio.integrated_snr(paths.gain[cycle, path])
        lone = 1.0 / np.sqrt(power)[:, None] * unit_bound(radio)
        rows.append(np.column_stack([paths.kind[path], error, deviation, lone]))
    table, paths_table = np.vstack(rows), np.vstack(offered)
    scale = np.array([radio.bandwidth, 1.0, 1.0])
    return Findings(
        table[:, 0].astype(int), table[:, 1:4] * scale, table[:, 4:7] * scale, table[:, 7:10] * scale,
        paths_table[:, 0], paths_table[:, 1].astype(int), paths_table[:, 2], paths_table[:, 3],
        false / paths.num_cycles, seconds / paths.num_cycles,
    )  # fmt: skip


def unit_bound(radio: RadioConfig) -> Floats:
    """Bounds (3,) of delay [s] and cosines at an SNR of one over all antennas."""
    delay = 1.0 / np.sqrt(8.0 * np.pi**2 * radio.effective_bandwidth_squared)
    x = 2.0 * np.pi * radio.array.positions(1.0)[:, :2]
    return np.array([delay, *(1.0 / np.sqrt(2.0 * np.mean(x**2, axis=0)))])


def report(title: str, found: Findings) -> None:
    """Per class: how many, share found above 13 dB, errors over what is reported and over the lone bound."""
    print(f"{title}: {found.false:.2f} unidentified a cycle, {1e3 * found.seconds:.0f} ms a cycle")
    print("  class  found  share>13dB (apart)   error/reported: 68 % of tau, u, v      error/lone bound: 68 %")
    for kind in PathKind:
        mine, loud = found.kind == kind, (found.offered_kind == kind) & (found.offered_snr > 13.0)
        if not mine.any():
            continue
        apart = loud & (found.offered_alone > 1.0)
        share = np.mean(found.offered_found[loud]) if loud.any() else np.nan
        share_apart = np.mean(found.offered_found[apart]) if apart.any() else np.nan
        told, lone = spread(found.error[mine] / found.deviation[mine]), spread(found.error[mine] / found.lone[mine])
        print(f"  {kind.name:5s} {mine.sum():6d}  {share:5.2f} ({share_apart:4.2f})  {told.round(2)}  {lone.round(2)}")


def spread(values: Floats) -> Floats:
    """Half-width that holds 68.3 % of the values: the deviation, were they normal."""
    return np.quantile(np.abs(values), 0.6827, axis=0)


def compare(waveform: list[Findings], bound: list[Findings]) -> None:
    """Per class, all SNRs together: deviations of the errors, waveform over bound."""
    print("error of the waveform estimator over that of the joint bound: 68 % half-widths of tau, u, v")
    for kind in PathKind:
        ratio = []
        for runs in (waveform, bound):
            normalised = [found.error[found.kind == kind] / found.lone[found.kind == kind] for found in runs]
            ratio.append(np.concatenate(normalised))
        if min(len(part) for part in ratio) > 20:
            counts = ", ".join(str(len(part)) for part in ratio)
            print(f"  {kind.name:5s} {(spread(ratio[0]) / spread(ratio[1])).round(2)}  ({counts} components)")


def false_rates(paths: Paths, motion: Trajectory, rate: float) -> tuple[float, float]:
    """False components a cycle in the room (sphere at 13 dB), and on noise alone."""
    config = ReceiverConfig(estimator="waveform", false_alarm_rate=rate, alternation=False)
    radio = with_reference_snr(RadioConfig(), 13.0)
    room = run(paths, motion, radio, config, 3).false
    silent = replace(paths, valid=np.zeros_like(paths.valid))
    return room, run_silent(silent, motion, radio, config)


def run_silent(paths: Paths, motion: Trajectory, radio: RadioConfig, config: ReceiverConfig) -> float:
    rng = np.random.default_rng(4)
    count = [len(measure(paths, k % paths.num_cycles, 0.0, radio, config, rng=rng)[0]) for k in range(400)]
    return float(np.mean(count))


def draw(findings: dict[str, list[Findings]], rates: Floats, file: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13.5, 4.0), layout="constrained")
    middle = 0.5 * (BINS_DB[1:] + BINS_DB[:-1])
    for name, style in (("waveform", "o-"), ("bound, joint", "s--"), ("bound, cell", "^:")):
        runs = findings[name]
        snr = np.concatenate([found.offered_snr for found in runs])
        hit = np.concatenate([found.offered_found for found in runs])
        alone = np.concatenate([found.offered_alone for found in runs])
        for panel, keep in ((0, np.isfinite(snr)), (1, alone > 1.0)):
            axes[panel].plot(middle, binned(snr[keep], hit[keep]), style, label=name)
    fine = np.linspace(0.0, 40.0, 200)
    axes[1].plot(fine, detection_probability(10.0 ** (fine / 10.0), 10.0), color="0.5", label="Marcum Q, lone path")
    for panel, title in ((0, "All paths"), (1, "Paths a cell away from rivals")):
        axes[panel].set(
            xlabel="SNR of the path over all antennas [dB]", ylabel="share found", title=title, ylim=(-0.03, 1.03)
        )
        axes[panel].legend(frameon=False, loc="lower right")
    axes[2].loglog(RATES, rates[:, 1], "o-", label="noise alone")
    axes[2].loglog(RATES, rates[:, 0], "s-", label="paper's room")
    axes[2].loglog(RATES, RATES, color="0.5", label="as set")
    axes[2].set(xlabel="false components a cycle, set", ylabel="counted", title="False alarms")
    axes[2].legend(frameon=False)
    figure.savefig(file, dpi=130)


def binned(snr: Floats, hit: Floats) -> Floats:
    """Mean of hits per bin of SNR; NaN with fewer than 15."""
    bins = np.digitize(snr, BINS_DB) - 1
    values = [np.mean(hit[bins == b]) if np.sum(bins == b) >= 15 else np.nan for b in range(len(BINS_DB) - 1)]
    return np.array(values)


if __name__ == "__main__":
    main()
