"""What motion within the measurement slot leaves in the difference of two alternated codes, class by class.

Along the paper's track at its 0.1 m/s, the panel focused on the agent: the SNR of what each path that the array hears
leaves in the capture that it does not belong to (walls and scatterers in the difference, the panel's in the sum), for
the order A-B, the order A-B-B-A, and codes held for microseconds. Then what the waveform receiver makes of it:
components of the difference that are no panel's, and the probability that it gives them. Run:
`python benchmarks/receiver/slot_motion.py [--places 60] [--snr 0] [--figure FILE]`.
"""

import argparse
from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import focus_codes
from rislam_rt.measurement import ReceiverConfig, measure, receive, with_reference_snr
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import PathKind, Paths, RadioConfig, Scene, Trajectory
from rislam_rt.scene import load_scene

SLOTS = {
    "A-B, 5 ms each": ReceiverConfig(estimator="bound", alternation=True, order="AB"),
    "A-B-B-A, 2.5 ms each": ReceiverConfig(estimator="bound", alternation=True, order="ABBA"),
    "A-B, 10 us each, repeated": ReceiverConfig(estimator="bound", alternation=True, order="AB", code_dwell=10e-6),
    "A-B-B-A, 10 us each, repeated": ReceiverConfig(
        estimator="bound", alternation=True, order="ABBA", code_dwell=10e-6
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=60)
    parser.add_argument("--snr", type=float, default=13.0, help="of the paper's sphere at 3 m, over all antennas [dB]")
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    radio = with_reference_snr(RadioConfig(), arguments.snr)
    rows = np.linspace(0, len(scene.agent) - 1, arguments.places).astype(int)
    motion = scene.agent[rows]
    paths = focused(scene, radio, motion)
    shift = doppler_shift(paths, motion, radio.wavelength)
    table = {name: leaks(paths, motion, radio, config, shift) for name, config in SLOTS.items()}
    kinds = [kind for kind in PathKind if np.any(next(iter(table.values()))[:, 0] == kind)]
    print("leak above 10 dB: paths a cycle by class (own SNR above 10 dB), largest leak [dB]")
    for name, found in table.items():
        words = []
        for kind in kinds:
            mine = found[found[:, 0] == kind]
            loud = mine[mine[:, 1] > 10.0]
            over = np.sum(loud[:, 2] > 10.0) / len(motion)
            words.append(f"{kind.name} {over:.2f} of {len(loud) / len(motion):.1f}, {mine[:, 2].max():.0f} dB")
        print(f"  {name}: " + "; ".join(words))
    print(
        "waveform: components of the difference a cycle that are the panel's, a leak, false; mean probability of each"
    )
    for name, config in list(SLOTS.items())[:3]:
        print(f"  {name}: " + found_in(paths, motion, radio, replace(config, estimator="waveform"), shift))
    if arguments.figure is not None:
        draw(table, kinds, arguments.figure, arguments.snr)


def focused(scene: Scene, radio: RadioConfig, motion: Trajectory) -> Paths:
    """Paths with the panel set, in every cycle, to the best code of its direct path."""
    tracer = ImageSourceChannel(scene, radio, 2)
    paths = tracer.paths(motion)
    assert scene.ris is not None
    return tracer.respond(paths, focus_codes(paths, scene.ris.spec.levels))


def leaks(paths: Paths, motion: Trajectory, radio: RadioConfig, config: ReceiverConfig, shift: Floats) -> Floats:
    """(N, 3) class, own SNR [dB] and SNR of the leak [dB] of every path heard in every cycle."""
    found = []
    for cycle in range(len(motion)):
        heard = receive(paths, cycle, float(motion.heading[cycle]), radio, config, shift[cycle])
        common, difference = split_by_code(heard, config)
        leak = np.where(heard.panel >= 0, common.gain, difference.gain)
        snr = [10.0 * np.log10(np.maximum(radio.integrated_snr(gain), 1e-9)) for gain in (heard.gain, leak)]
        found.append(np.column_stack([paths.kind[heard.path], *snr]))
    return np.vstack(found)


def found_in(paths: Paths, motion: Trajectory, radio: RadioConfig, config: ReceiverConfig, shift: Floats) -> str:
    """What the receiver reports as weak as a leak may be, by what it truly is."""
    rng, sorted_out = np.random.default_rng(1), {"panel": [], "leak": [], "false": []}  # type: ignore[var-annotated]
    over = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    for cycle in range(len(motion)):
        measurement, truth = measure(
            paths, cycle, float(motion.heading[cycle]), radio, config, None, shift[cycle], rng=rng
        )
        assert measurement.from_panel is not None
        for path in np.unique(truth.path[truth.path >= 0]):
            mine = np.flatnonzero(truth.path == path)
            if over[path]:
                sorted_out["panel"].append(measurement.from_panel[mine[np.argmax(measurement.amplitude[mine])]])
            elif len(mine) > 1:
                sorted_out["leak"].append(measurement.from_panel[mine[np.argmin(measurement.amplitude[mine])]])
        false = (truth.path < 0) & (measurement.from_panel > 0.5)
        sorted_out["false"] += measurement.from_panel[false].tolist()
    return ", ".join(
        f"{name} {len(values) / len(motion):.2f} ({np.mean(values) if values else np.nan:.2f})"
        for name, values in sorted_out.items()
    )


def draw(table: dict[str, Floats], kinds: list[PathKind], file: str, snr: float) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(kinds), figsize=(2.4 * len(kinds), 4.0), sharey=True, layout="constrained")
    names = list(table)[:3]
    for axis, kind in zip(axes, kinds, strict=True):
        for place, name in enumerate(names):
            found = table[name]
            mine = found[(found[:, 0] == kind) & (found[:, 1] > 10.0)]
            values = np.maximum(mine[:, 2], -60.0)
            jitter = np.random.default_rng(0).uniform(-0.3, 0.3, len(values))
            axis.scatter(place + jitter, values, s=3, alpha=0.35, color=f"C{place}", rasterized=True)
            share = np.mean(values > 10.0) if len(values) else 0.0
            axis.text(place, 42.0, f"{100.0 * share:.0f} %", ha="center", fontsize=8)
        axis.axhline(10.0, color="0.3", lw=0.8, ls="--")
        axis.set(title=kind.name, xticks=range(len(names)), ylim=(-65.0, 47.0))
        axis.set_xticklabels(["A-B", "A-B-B-A", "10 us"], fontsize=8)
    axes[0].set_ylabel("SNR of what motion leaves in the wrong capture [dB]")
    figure.suptitle(
        f"Paths above 10 dB, sphere at {snr:.0f} dB, 0.1 m/s: share above the threshold of 10 dB", fontsize=10
    )
    figure.savefig(file, dpi=130)


if __name__ == "__main__":
    main()
