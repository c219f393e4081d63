"""Does the estimator reach the bound on a lone path, and when does it resolve two?

Lone path: RMSE over the Cramer-Rao bound and bias over the bound, of delay and both cosines, at 10 to 40 dB of SNR over
all antennas. Two paths of equal strength and random phase: how often both are found, each within half of their
separation, against separation in delay and in angle. Run: `python benchmarks/receiver/bound.py [--trials 400]
[--pairs 60] [--figure FILE]`.
"""

import argparse
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.information import measurement_std
from rislam_rt.measurement import Received, ReceiverConfig, capture, find_components
from rislam_rt.model import RadioConfig

RADIO = RadioConfig()
CONFIG = ReceiverConfig(estimator="waveform", false_alarm_rate=0.01, alternation=False)
SNRS_DB = np.array([10.0, 12.5, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0])
PAIR_SNRS_DB = (20.0, 30.0, 40.0)
DELAYS = np.array([0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5, 2.0])
"""Separations in delay [c/B]."""
ANGLES = np.array([0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5])
"""Separations in one cosine [beam widths, 1 / (elements x spacing)]."""
BEAM = 1.0 / (RADIO.array.rows * RADIO.array.spacing)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=400)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    rng = np.random.default_rng(5)
    lone = np.array([lone_path(snr, arguments.trials, rng) for snr in SNRS_DB])
    print(f"lone path, {arguments.trials} trials: SNR, detected, RMSE / bound and |bias| / bound of tau, u, v")
    for snr, row in zip(SNRS_DB, lone, strict=True):
        print(f"{snr:5.1f} dB  {row[0]:.3f}  {np.round(row[1:4], 3)}  {np.round(row[4:], 3)}")
    in_delay = np.array([[resolved(s, d, 0.0, arguments.pairs, rng) for d in DELAYS] for s in PAIR_SNRS_DB])
    in_angle = np.array([[resolved(s, 0.0, a * BEAM, arguments.pairs, rng) for a in ANGLES] for s in PAIR_SNRS_DB])
    for name, axis, table in (("delay [c/B]", DELAYS, in_delay), ("angle [beams]", ANGLES, in_angle)):
        print(f"two paths, share resolved against separation in {name}: {axis.tolist()}")
        for snr, row in zip(PAIR_SNRS_DB, table, strict=True):
            print(f"{snr:5.1f} dB  {np.round(row, 2).tolist()}  90 % from {limit(axis, row):.2f}")
    if arguments.figure is not None:
        draw(lone, in_delay, in_angle, arguments.figure)


def received(tau: Floats, cosines: Floats, snr_db: float, phase: Floats) -> Received:
    """Paths of equal SNR (over all antennas) at delays [1/B] and cosines."""
    amplitude = np.sqrt(10.0 ** (snr_db / 10.0) * RADIO.noise_psd / (RADIO.array.num_antennas * RADIO.energy))
    up = np.sqrt(1.0 - np.sum(cosines**2, axis=1))
    count = len(tau)
    return Received(
        np.arange(count), tau / RADIO.bandwidth, np.column_stack([cosines, up]), amplitude * np.exp(1j * phase),
        np.full(count, -1), np.full(count, 10.0), np.zeros(count),
    )  # fmt: skip


def lone_path(snr_db: float, trials: int, rng: np.random.Generator) -> Floats:
    """Share detected, then RMSE over bound and |bias| over bound (3 each) of those; places and phases are random."""
    bound = measurement_std(np.array(10.0 ** (snr_db / 10.0)), RADIO)
    scale = np.array([bound.tau * RADIO.bandwidth, *bound.cosines])
    errors = []
    for _ in range(trials):
        place = np.array([rng.uniform(10.0, 60.0), *rng.uniform(-0.6, 0.6, 2)])
        truth = received(place[:1], place[None, 1:], snr_db, rng.uniform(-np.pi, np.pi, 1))
        found = find_components(capture(truth, RADIO, CONFIG, rng=rng), RADIO, CONFIG)
        points = np.column_stack([found.tau * RADIO.bandwidth, found.cosines])
        near = np.all(np.abs(points - place) < [1.0, BEAM, BEAM], axis=1)
        if near.any():
            errors.append((points[near][0] - place) / scale)
    table = np.array(errors)
    return np.concatenate([[len(errors) / trials], np.sqrt(np.mean(table**2, axis=0)), np.abs(table.mean(axis=0))])


def resolved(snr_db: float, gap: float, turn: float, trials: int, rng: np.random.Generator) -> float:
    """Share of trials in which both of two paths are found, each within half of their separation."""
    hits = 0
    for _ in range(trials):
        place = np.array([rng.uniform(10.0, 60.0), *rng.uniform(-0.3, 0.1, 2)])
        other = place + np.array([gap, turn, 0.0])
        phase = rng.uniform(-np.pi, np.pi, 2)
        truth = received(
            np.array([place[0], other[0]]), np.stack([place[1:], other[1:]]), snr_db, phase
        )  # fmt: skip
        found = find_components(capture(truth, RADIO, CONFIG, rng=rng), RADIO, CONFIG)
        points = np.column_stack([found.tau * RADIO.bandwidth, found.cosines])
        # projected on the line between the two, in units of their separation
        step = other - place
        along = (points - place) @ step / (step @ step)
        hits += bool(np.any(np.abs(along) < 0.5) and np.any(np.abs(along - 1.0) < 0.5))
    return hits / trials


def limit(axis: Floats, share: Floats) -> float:
    """Smallest separation from which on at least 90 % are resolved."""
    bad = np.flatnonzero(share < 0.9)
    first = bad[-1] + 1 if len(bad) else 0
    return float(axis[first]) if first < len(axis) else np.inf


def draw(lone: Floats, in_delay: Floats, in_angle: Floats, file: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13.0, 3.8), layout="constrained")
    for column, name in enumerate(("delay", "cosine u", "cosine v")):
        axes[0].plot(SNRS_DB, lone[:, 1 + column], "o-", label=name)
    axes[0].axhline(1.2, color="0.6", linestyle=":")
    axes[0].annotate("1.2", (38.5, 1.21), color="0.4")
    axes[0].set(
        xlabel="SNR over all antennas [dB]", ylabel="RMSE / Cramér-Rao bound", ylim=(0.8, 1.4), title="One path"
    )
    for panel, axis, table, unit in (
        (1, DELAYS, in_delay, "delay [c/B]"),
        (2, ANGLES, in_angle, "cosine [beam widths]"),
    ):
        plot_pairs(axes[panel], axis, table, unit)
    axes[0].legend(frameon=False)
    figure.savefig(file, dpi=130)


def plot_pairs(axes: Any, axis: Floats, table: Floats, unit: str) -> None:
    for snr, row in zip(PAIR_SNRS_DB, table, strict=True):
        axes.plot(axis, row, "o-", label=f"{snr:.0f} dB each")
    axes.axhline(0.9, color="0.6", linestyle=":")
    axes.set(xlabel=f"separation in {unit}", ylabel="share resolved", ylim=(-0.03, 1.03), title="Two equal paths")
    axes.legend(frameon=False, loc="lower right")


if __name__ == "__main__":
    main()
