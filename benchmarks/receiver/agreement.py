"""Does a receiver agree with another one, class by class, in rooms that neither was made for?

Random rooms with a panel, and walks (those of the classifier's study; each seed is one room). In each, every receiver
hears the same paths under the same codes, exact for the true place in even seeds, random in odd ones, the reference
sphere at 0 or 13 dB, codes held or alternated. With `--walk` the filter is led along on what it hears. Per class: share
of paths found, errors over reported deviations and deviations, shares beyond five of them; false components, how many
of them come again, level returns on the wrong side, error of the agent, and whether the panel was named. The first
receiver is the one that the others are compared with. Run: `python benchmarks/receiver/agreement.py --first 2000
--rooms 50 [--cycles 60] [--receivers waveform,cell] [--before FOLDER] [--walk] [--keep FOLDER] [--figure FILE]`. What
was run is kept in FOLDER by receiver and seed; a file that is taken away is run again. `--before` takes, as first
receiver, what the waveform receiver of another version of the code left in its folder, where this file was run.
"""

import argparse
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import exact_code
from rislam_rt.errors import RislamError
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.measurement import ReceiverConfig, build_sensor, measure, receive, with_reference_snr
from rislam_rt.model import Measurement, PathKind, Paths, PathTruth, RadioConfig, RisCode, Scene, Trajectory
from rislam_rt.ris import rephase
from rislam_rt.scene.random_rooms.box_rooms import random_room
from rislam_rt.slam import SlamConfig, StartPrior, estimate, init, step
from rislam_rt.studies.classifier.walks import random_walk

RECEIVERS: dict[str, dict[str, Any]] = {
    "waveform": {"estimator": "waveform"},
    "cell": {"estimator": "bound", "resolution": "cell"},
    "joint": {"estimator": "bound", "resolution": "joint"},
}
SNR_DB = (0.0, 13.0)
"""Of the paper's sphere at 3 m; every other pair of seeds has the second."""
CLASSES = [kind for kind in PathKind if kind is not PathKind.LOS]
LEVEL = 0.98
"""Length of the two cosines from which on a return counts as level: within 11 degrees of the horizon."""
SURE = 0.5
"""Deviation of a cosine [cells] below which a component claims to know its side, four cells from the other."""
FAR = 5.0
"""Reported deviations beyond which an error counts as a tail."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=60)
    parser.add_argument("--receivers", default="waveform,cell")
    parser.add_argument("--keep", default="/tmp/receiver_agreement")
    parser.add_argument("--before", default=None, help="folder of another version's waveform receiver")
    parser.add_argument("--walk", action="store_true", help="lead the filter along")
    parser.add_argument("--figure", default=None)
    arguments = parser.parse_args()
    names, found = arguments.receivers.split(","), {}
    names = names if arguments.before is None else ["before", *names]
    seeds = range(arguments.first, arguments.first + arguments.rooms)
    for name in names:
        found[name] = [kept("heard", hear, name, seed, arguments) for seed in seeds]
    report(names, found)
    report_ghosts(names, found)
    if arguments.walk:
        walks = {name: [kept("walked", walk, name, seed, arguments) for seed in seeds] for name in names}
        report_walks(names, walks)
    if arguments.figure is not None:
        draw(names, found, arguments.figure)


def kept(kind: str, work: Any, name: str, seed: int, arguments: argparse.Namespace) -> dict[str, Any]:
    """One room with one receiver, from the folder if it is there."""
    folder, label = (arguments.before, "waveform") if name == "before" else (arguments.keep, name)
    file = Path(folder) / f"{kind}-{label}-{seed}-{arguments.cycles}.npz"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        result = work(name, seed, arguments)
        np.savez_compressed(file, **result)
        if kind == "heard":
            print(f"{file.stem}: {float(result['seconds']) * 1e3:.1f} ms a cycle", flush=True)
    with np.load(file) as data:
        return {key: data[key] for key in data.files}


def room_of(seed: int, cycles: int) -> tuple[Scene, Trajectory, Paths, RadioConfig, RisCode]:
    """A room with a panel, a walk, and its paths under the codes of the seed."""
    for attempt in range(100):
        rng = np.random.default_rng([seed, attempt])
        scene = random_room(f"room_{seed}", rng=rng)
        if scene.ris is None:
            continue
        try:
            motion = random_walk(scene, cycles, rng=rng)
            break
        except RislamError:
            continue
    radio = with_reference_snr(RadioConfig(), SNR_DB[(seed // 2) % 2])
    paths = ImageSourceChannel(scene, radio, 2).paths(motion)
    assert scene.ris is not None
    panel = scene.ris.spec
    index = rng.integers(panel.levels, size=(cycles, panel.rows, panel.cols))
    direct = np.flatnonzero(paths.kind == PathKind.RIS)
    if seed % 2 == 0 and len(direct) and paths.ris is not None:
        tx, rx = paths.ris.tx[:, paths.ris.tx_leg[direct[0]]], paths.ris.rx[:, paths.ris.rx_leg[direct[0]]]
        index = exact_code((tx * rx).reshape(cycles, -1), panel.levels)[0].reshape(tx.shape)
    code = RisCode(index, panel.levels)
    return scene, motion, rephase(paths, code), radio, code


def settings_of(name: str, seed: int) -> ReceiverConfig:
    """Four seeds with the codes held, four with code and twin."""
    return ReceiverConfig(**RECEIVERS["waveform" if name == "before" else name], alternation=bool((seed // 4) % 2))


def hear(name: str, seed: int, arguments: argparse.Namespace) -> dict[str, Any]:
    """Everything that a receiver reports along one walk, raw and scored."""
    _, motion, paths, radio, _ = room_of(seed, arguments.cycles)
    config = settings_of(name, seed)
    shift, rng = doppler_shift(paths, motion, radio.wavelength), np.random.default_rng([seed, 77])
    rows, offered, raw, seconds = [], [], [], 0.0
    previous: Measurement | None = None
    for cycle in range(len(motion)):
        heading = float(motion.heading[cycle])
        begin = time.process_time()
        previous, truth = measure(paths, cycle, heading, radio, config, previous, shift[cycle], rng=rng)
        seconds += time.process_time() - begin
        side = np.full(len(previous), np.nan) if previous.from_panel is None else previous.from_panel
        raw.append(np.column_stack([
            np.full(len(previous), cycle), previous.tau, previous.cosines, previous.amplitude, previous.tau_std,
            previous.cosines_std, previous.amplitude_std, side,
        ]))  # fmt: skip
        rows.append(score(paths, motion, cycle, radio, previous, truth))
        there = receive(paths, cycle, heading, radio, config)
        snr = 10.0 * np.log10(radio.integrated_snr(there.gain))
        heard = (there.tau < config.max_delay) & (snr > 0.0)
        offered.append(np.column_stack([paths.kind[there.path], snr, np.isin(there.path, truth.path)])[heard])
    return {
        "table": np.vstack(rows), "offered": np.vstack(offered), "raw": np.vstack(raw),
        "seconds": np.array(seconds / len(motion)), "cycles": np.array(len(motion)),
    }  # fmt: skip


def walk(name: str, seed: int, arguments: argparse.Namespace) -> dict[str, Any]:
    """The filter on what was heard: position errors, and whether the panel was named and where."""
    scene, motion, _, radio, code = room_of(seed, arguments.cycles)
    raw = kept("heard", hear, name, seed, arguments)["raw"]
    rng, config = np.random.default_rng([seed, 78]), SlamConfig(use_vt=True)
    wrong = 0.01 * rng.standard_normal((2, 3)) * [1.0, 1.0, 0.0]
    start = StartPrior(motion.position[0] + wrong[0], motion.velocity[0] + wrong[1], float(motion.heading[0]))
    assert scene.ris is not None
    sensor = build_sensor(radio, settings_of(name, seed))
    state = init(start, motion.body, scene.ris.spec, sensor, config, rng=rng)
    error, named, place = np.zeros(len(motion)), np.zeros(len(motion)), np.full((len(motion), 3), np.nan)
    for cycle in range(len(motion)):
        mine = raw[raw[:, 0] == cycle, 1:]
        side = None if np.isnan(mine[:, 8]).any() or not settings_of(name, seed).alternation else mine[:, 8]
        seen = Measurement(mine[:, 0], mine[:, 1:3], mine[:, 3], mine[:, 4], mine[:, 5:7], mine[:, 7], side)
        dt = float(motion.time[cycle] - motion.time[cycle - 1]) if cycle else 0.0
        now = RisCode(code.index[cycle], code.levels)
        state, _ = step(state, seen, now, dt, float(motion.heading[cycle]), config, rng=rng)
        belief = estimate(state, config)
        error[cycle] = np.linalg.norm(belief.position - motion.position[cycle])
        if len(belief.map.ris_probability) and belief.map.ris_probability.max() > 0.5:
            named[cycle] = belief.map.ris_probability.max()
            place[cycle] = belief.map.position[int(np.argmax(belief.map.ris_probability))]
    away = np.linalg.norm(place - scene.ris.center, axis=1)
    return {"error": error, "named": named, "away": away}


def report_walks(names: list[str], walks: dict[str, list[dict[str, Any]]]) -> None:
    """Errors of the agent, and in which runs the panel was named within half a metre of its place."""
    rms = {name: np.array([np.sqrt(np.mean(one["error"] ** 2)) for one in walks[name]]) for name in names}
    right = {
        name: np.array([bool(np.min(np.nan_to_num(one["away"][-10:], nan=np.inf)) < 0.5) for one in walks[name]])
        for name in names
    }
    rng = np.random.default_rng(0)
    for name in names:
        alike = np.sum(right[name] == right[names[0]])
        ratio = np.log(rms[name] / rms[names[0]])
        draws = np.exp(ratio[rng.integers(len(ratio), size=(4000, len(ratio)))].mean(axis=1))
        low, high = np.quantile(draws, [0.025, 0.975])
        print(
            f"{name}: RMSE of the agent, median {1e3 * np.median(rms[name]):.1f} mm, root mean square "
            f"{1e3 * np.sqrt(np.mean(rms[name] ** 2)):.1f} mm, over that with {names[0]} run by run "
            f"{np.exp(ratio.mean()):.3f} ({low:.3f} to {high:.3f}); panel named in its place in "
            f"{right[name].sum()} of {len(right[name])} runs, as with {names[0]} in {alike}"
        )


def score(
    paths: Paths, motion: Trajectory, cycle: int, radio: RadioConfig, found: Measurement, truth: PathTruth
) -> Floats:
    """(M, 13) cycle, what each component is, path, errors and deviations in cells, SNR, distance to any path.

    Then the length of the path's cosines, 1 for a level one, and its distance [cells] to the nearest other one.
    """
    cells = np.array([radio.bandwidth, radio.array.rows * radio.array.spacing, radio.array.cols * radio.array.spacing])
    place = np.column_stack([found.tau, found.cosines]) * cells
    deviation = np.column_stack([found.tau_std, found.cosines_std]) * cells
    arrival = (paths.arrival[cycle] @ rotation_z(motion.heading[cycle]))[:, :2]
    true = np.column_stack([paths.tau[cycle], arrival]) * cells
    known = truth.path >= 0
    error = np.where(known[:, None], place - true[truth.path], np.nan)
    snr = 10.0 * np.log10(radio.integrated_snr(found.amplitude))
    there = np.flatnonzero(paths.valid[cycle] & (radio.integrated_snr(paths.gain[cycle]) > 1.0))
    gap = (place[:, None] - true[there]) / deviation[:, None]
    nearest = np.sqrt(np.min(np.max(gap**2, axis=-1), axis=1, initial=np.inf))
    kind = np.where(known, paths.kind[truth.path], -1)
    apart = np.linalg.norm(true[truth.path][:, None] - true[there], axis=-1)
    apart[truth.path[:, None] == there] = np.inf
    lone, level = np.min(apart, axis=1, initial=np.inf), np.linalg.norm(arrival[truth.path], axis=1)
    return np.column_stack([np.full(len(snr), cycle), kind, truth.path, error, deviation, snr, nearest, level, lone])


class Row(NamedTuple):
    """One receiver on one class."""

    found: float
    """Share of the paths above 10 dB that were found."""
    count: float
    """Components a cycle."""
    ratio: Floats
    """(3,) half-width that holds 68 % of errors over reported deviations: 1, were they right and normal."""
    deviation: Floats
    """(3,) median reported deviation [cells]."""
    error: Floats
    """(3,) half-width that holds 68 % of the errors [cells]."""
    tail: float
    """Share beyond five reported deviations in any parameter."""


def row_of(runs: list[dict[str, Any]], kind: int) -> Row:
    """One class."""
    table, offered = (np.vstack([one[name] for one in runs]) for name in ("table", "offered"))
    mine, loud = table[table[:, 1] == kind], offered[(offered[:, 0] == kind) & (offered[:, 1] > 10.0)]
    error, deviation = np.abs(mine[:, 3:6]), mine[:, 6:9]
    if not len(mine):  # nothing of this class was heard
        none = np.full(3, np.nan)
        return Row(float(np.mean(loud[:, 2])) if len(loud) else np.nan, 0.0, none, none, none, np.nan)
    return Row(
        float(np.mean(loud[:, 2])) if len(loud) else np.nan, len(mine) / sum(int(one["cycles"]) for one in runs),
        np.quantile(error / deviation, 0.683, axis=0), np.median(deviation, axis=0), np.quantile(error, 0.683, axis=0),
        float(np.mean((error / deviation > FAR).any(axis=1))),
    )  # fmt: skip


def report(names: list[str], found: dict[str, list[dict[str, Any]]]) -> None:
    """One block a class, one line a receiver; then what belongs to no path."""
    print(f"{len(found[names[0]])} rooms, {sum(int(one['cycles']) for one in found[names[0]])} cycles")
    print(
        "class receiver: found above 10 dB, components a cycle; error / reported deviation (68 %), reported deviation"
    )
    print("(median) and error (68 %) in cells, of delay and cosines; beyond five deviations")
    for kind in PathKind:
        for name in names:
            row = row_of(found[name], kind)
            print(
                f"{kind.name:5s}{name:>9s}: {row.found:.3f} {row.count:6.2f}  {row.ratio.round(2)} "
                f"{row.deviation.round(4)} {row.error.round(4)}  {row.tail:.4f}"
            )
    for name in names:
        table = np.vstack([one["table"] for one in found[name]])
        cycles = sum(int(one["cycles"]) for one in found[name])
        known, far = table[:, 1] >= 0, table[:, 10] > FAR
        tail = np.mean((np.abs(table[known, 3:6]) / table[known, 6:9] > FAR).any(axis=1))
        print(
            f"{name}: {len(table) / cycles:.2f} components a cycle, {np.sum(~known) / cycles:.3f} of no path, "
            f"{np.sum(far) / cycles:.3f} farther than five deviations from every path, of those above 16 dB "
            f"{np.sum(far & (table[:, 9] > 16.0)) / cycles:.3f}; of all of a path {tail:.4f} "
            f"beyond five; {1e3 * np.mean([float(one['seconds']) for one in found[name]]):.2f} ms a cycle"
        )


def again(found: dict[str, Any]) -> tuple[int, int]:
    """Of the components farther than five deviations from every path: how many come again in the next cycle, and all.

    Again is within half a cell in delay and both cosines; the last cycle has no next one.
    """
    table, raw = found["table"], found["raw"]
    place = raw[:, 1:4] / np.array([1e-9, 0.5, 0.5])  # cells of 1 GHz and four elements half a wavelength apart
    far, last = table[:, 10] > FAR, int(found["cycles"]) - 1
    count = total = 0
    for cycle in range(last):
        now, after = (place[far & (table[:, 0] == number)] for number in (cycle, cycle + 1))
        gap = np.abs(now[:, None] - after).max(axis=-1)
        count, total = count + int(np.sum(np.min(gap, axis=1, initial=np.inf) < 0.5)), total + len(now)
    return count, total


def report_ghosts(names: list[str], found: dict[str, list[dict[str, Any]]]) -> None:
    """How false components hang together in time, and what becomes of level returns."""
    for name in names:
        count, total = np.sum([again(one) for one in found[name]], axis=0)
        table = np.vstack([one["table"] for one in found[name]])
        lone = table[(table[:, 1] == PathKind.VT) & (table[:, 11] > LEVEL) & (table[:, 12] > 1.0)]
        wrong = (np.abs(lone[:, 4:6]) > 2.0).any(axis=1)  # a period of the array is four cells
        sure = wrong & (lone[:, 7:9].max(axis=1) < SURE)
        print(
            f"{name}: of {total} components far from every path {count / max(total, 1):.3f} come again in the next "
            f"cycle; of {len(lone)} lone level wall returns {np.mean(wrong):.4f} on the wrong side, "
            f"{np.mean(sure):.4f} with deviations below {SURE} cells"
        )


def draw(names: list[str], found: dict[str, list[dict[str, Any]]], file: str) -> None:
    """Detection, deviations, errors over them, and tails, class by class."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(14.0, 3.8), layout="constrained")
    titles = (
        "share of paths above 10 dB found",
        "reported deviation of the delay [cells], median",
        "error of the delay over it, 68 %",
        "share beyond five deviations",
    )
    for number, name in enumerate(names):
        rows = [row_of(found[name], kind) for kind in CLASSES]
        place = np.arange(len(CLASSES)) + (number - (len(names) - 1) / 2.0) * 0.8 / len(names)
        values = (
            [r.found for r in rows], [r.deviation[0] for r in rows], [r.ratio[0] for r in rows], [r.tail for r in rows],
        )  # fmt: skip
        for axis, heights in zip(axes, values, strict=True):
            axis.bar(place, heights, 0.8 / len(names), label=name)
    for axis, title in zip(axes, titles, strict=True):
        axis.set(title=title, xticks=range(len(CLASSES)))
        axis.set_xticklabels([kind.name for kind in CLASSES])
        axis.title.set_fontsize(10)
    axes[3].legend(frameon=False, fontsize=8, loc="upper right")
    figure.savefig(file, dpi=130)


if __name__ == "__main__":
    main()
