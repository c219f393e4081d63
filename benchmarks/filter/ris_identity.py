"""How many cycles until the agent knows which landmark is the panel?

The paper's room, 1, 2 or 5 scatterers and the panel, direct paths alone. The agent stands still, which gives it fewer
views than a moving one has, at a random place where the panel's root mean square gain over all codes is above the
detection threshold; a scatterer that would be too faint to be heard is made as large as it takes. Each landmark's place
is believed with an error of its own, drawn from the covariance that the belief states. Amplitudes under random codes (a
new one each cycle, or one held), Rician, and missed below the threshold. An error is a trial in which, of the landmarks
heard so far, the one with the highest probability is not the panel; so is a panel not heard. Run:
`python benchmarks/filter/ris_identity.py [--trials 20000] [--others 2000] [--figure FILE] [--json FILE]`.
"""

import argparse
import json
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import beta

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.information import amplitude_std
from rislam_rt.measurement import with_reference_snr
from rislam_rt.model import RadioConfig, RisCode, Scene
from rislam_rt.report.style import save_figure, styled
from rislam_rt.ris import leg_response
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.scene import load_scene
from rislam_rt.slam.panel_evidence import (
    STRENGTHS,
    add_evidence,
    log_panel,
    log_panel_missed,
    log_scatterer,
    log_scatterer_missed,
)

BLOCK = 400
"""Trials in memory at once."""
SAMPLES = 24
"""Samples of the belief, as many as the filter takes."""
LOWEST, HIGHEST = [0.4, 0.4, 0.2], [5.6, 5.6, 1.4]
"""Where the agent stands [m]."""
RADII = (0.02, 0.1)
"""Radii [m] of the other scatterers; the first is the scene's own."""
THRESHOLD = 10.0
"""Measured SNR (linear, all antennas) above which a path is reported."""
PRIOR_LENGTH = 0.3
"""Least distance [m] of a scatterer from the agent."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#7a5c00", "#56B4E9")


class Case(NamedTuple):
    """One curve."""

    scatterers: int
    snr_db: float
    position_std: float
    """Of each landmark's believed place, each axis [m]."""
    changing: bool
    misses: bool = True
    """Whether cycles in which a landmark is not heard count."""


CASES = [
    *(Case(count, 13.0, 0.06, True) for count in (1, 2, 5)),
    *(Case(count, 13.0, 0.06, False) for count in (1, 2, 5)),
    Case(2, 13.0, 0.06, True, False),
    *(Case(2, snr, 0.06, True) for snr in (3.0, 8.0, 20.0, 30.0)),
    *(Case(2, 13.0, std, True) for std in (0.02, 0.15, 0.3)),
]
NUM_MAIN = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20000, help="of the first three cases")
    parser.add_argument("--others", type=int, default=2000, help="trials of each other case")
    parser.add_argument("--cycles", type=int, default=20)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    found: list[tuple[Case, Floats, int]] = []
    print("| scatterers | SNR [dB] | place std [m] | codes | trials | after 3 cycles | 5 | 10 | 20 | 95 % interval |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for number, case in enumerate(CASES):
        trials = arguments.trials if number < NUM_MAIN else arguments.others
        wrong = run_case(scene, case, trials, arguments.cycles)
        found.append((case, wrong, trials))
        print(_row(case, wrong, trials), flush=True)
    if arguments.json is not None:
        content = [{**case._asdict(), "wrong": wrong.tolist(), "trials": trials} for case, wrong, trials in found]
        arguments.json.write_text(json.dumps(content) + "\n")
    if arguments.figure is not None:
        draw(found, arguments.figure)
    print(f"{time.process_time():.0f} s of CPU time")


def run_case(scene: Scene, case: Case, trials: int, cycles: int) -> Floats:
    """Wrong trials (cycles,) after each cycle."""
    wrong = np.zeros(cycles)
    for block in range(0, trials, BLOCK):
        rng = np.random.default_rng([11, case.scatterers, block])
        wrong += run_block(scene, case, min(BLOCK, trials - block), cycles, rng=rng).sum(axis=0)
    return wrong


def run_block(scene: Scene, case: Case, trials: int, cycles: int, *, rng: np.random.Generator) -> Booleans:
    """Whether each trial (trials, cycles) names a wrong landmark; the panel is the last of them."""
    assert scene.ris is not None
    spec = scene.ris.spec
    radio = with_reference_snr(RadioConfig(), case.snr_db)
    agent = _places(scene, radio, trials, rng)
    true = _landmarks(scene, case.scatterers, agent, rng)
    count = case.scatterers + 1
    tx, rx = agent + scene.agent.body.tx_offset, agent + scene.agent.body.rx_offset
    codes = rng.integers(spec.levels, size=(trials, cycles if case.changing else 1, spec.rows, spec.cols))
    factor = np.exp(-1j * RisCode(codes, spec.levels).xi).reshape(*codes.shape[:2], -1)

    believed = true + case.position_std * rng.standard_normal((trials, count, 3))
    radii = np.exp(rng.uniform(*np.log(RADII), (trials, case.scatterers)))
    radii[:, 0] = scene.scatterers[0].radius
    tx_length, rx_length = (np.linalg.norm(true - end, axis=-1) for end in (tx, rx))
    unit = point_amplitude(np.sqrt(np.pi), tx_length[:, :-1], rx_length[:, :-1], radio)
    radii = np.maximum(radii, np.sqrt(THRESHOLD / radio.integrated_snr(unit)))
    mean = (unit * radii)[..., None]
    panel = _gains(spec, true[:, -1:], tx, rx, radio, factor)
    mean = np.concatenate([np.broadcast_to(mean, (*mean.shape[:2], cycles)),
                           np.broadcast_to(np.abs(panel), (trials, 1, cycles))], axis=1)  # fmt: skip
    std = amplitude_std(radio)
    noise = rng.standard_normal((*mean.shape, 2)) * std
    amplitude = np.hypot(mean + noise[..., 0], noise[..., 1])
    heard = radio.integrated_snr(amplitude) > THRESHOLD

    samples = believed[:, :, None] + case.position_std * rng.standard_normal((trials, count, SAMPLES, 3))
    samples = samples.reshape(trials, count * SAMPLES, 3)
    predicted = np.abs(_gains(spec, samples, tx, rx, radio, factor))
    predicted = np.broadcast_to(predicted, (*predicted.shape[:2], cycles)).reshape(trials, count, SAMPLES, cycles)
    lengths = [np.linalg.norm(believed - end, axis=-1).ravel() for end in (tx, rx)]
    return decide(amplitude, heard, predicted, lengths, std, radio, case.misses)


def decide(
    amplitude: Floats, heard: Booleans, predicted: Floats, lengths: list[Floats], std: float, radio: RadioConfig,
    misses: bool,
) -> Booleans:  # fmt: skip
    """The filter's own rule, cycle by cycle: amplitudes (trials, landmarks, cycles)."""
    trials, count, cycles = amplitude.shape
    grid = np.full((trials * count, len(STRENGTHS)), -np.log(len(STRENGTHS)))
    odds = np.zeros(trials * count)
    wrong = np.zeros((trials, cycles), dtype=bool)
    least = np.sqrt(2.0 * THRESHOLD) * std
    for cycle in range(cycles):
        for rows, here in ((np.flatnonzero(flag), bool(n)) for n, flag in enumerate(
            (~heard[..., cycle].ravel(), heard[..., cycle].ravel())
        )):  # fmt: skip
            seen, deviation = amplitude[..., cycle].ravel()[rows], np.full(len(rows), std)
            gain = predicted[..., cycle].reshape(trials * count, SAMPLES)[rows]
            legs = lengths[0][rows], lengths[1][rows]
            if here:
                evidence = log_scatterer(seen, deviation, *legs, radio), log_panel(seen, deviation, gain)
            elif not misses:
                continue
            else:
                evidence = (
                    log_scatterer_missed(deviation, *legs, radio, least),
                    log_panel_missed(deviation, gain, least),
                )
            grid[rows], odds[rows] = add_evidence(grid[rows], odds[rows], *evidence)
        # who was never heard is not on the map
        table = np.where(heard[..., : cycle + 1].any(axis=-1), odds.reshape(trials, count), -np.inf)
        wrong[:, cycle] = table[:, -1] <= table[:, :-1].max(axis=1)
    return wrong


def _places(scene: Scene, radio: RadioConfig, trials: int, rng: np.random.Generator) -> Floats:
    """(trials, 1, 3) [m]: random places where the panel's root mean square gain over all codes is heard."""
    assert scene.ris is not None
    found: list[Floats] = []
    while sum(map(len, found)) < trials:
        agent = rng.uniform(LOWEST, HIGHEST, (4 * trials, 3))
        legs = [leg_response(scene.ris.spec, scene.ris.center, agent + offset, np.ones(len(agent)), radio.wavelength)
                for offset in (scene.agent.body.tx_offset, scene.agent.body.rx_offset)]  # fmt: skip
        power = np.sum(np.abs(legs[0] * legs[1]) ** 2, axis=(1, 2))
        found.append(agent[radio.integrated_snr(np.sqrt(power)) > THRESHOLD])
    return np.concatenate(found)[:trials, None]


def _landmarks(scene: Scene, scatterers: int, agent: Floats, rng: np.random.Generator) -> Floats:
    """(trials, scatterers + 1, 3) [m]: the scene's sphere, others at random above the agent, the panel."""
    assert scene.ris is not None
    trials = len(agent)
    places = rng.uniform([0.3, 0.3, 0.0], [5.7, 5.7, 2.9], (trials, scatterers, 3))
    places[..., 2] = np.maximum(places[..., 2], agent[..., 2] + 0.1)
    places[:, 0, :2] = scene.scatterers[0].position[:2]
    places[:, 0, 2] = np.maximum(scene.scatterers[0].position[2], agent[:, 0, 2] + 0.1)
    way = places - agent
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    places = agent + way * np.maximum(distance, PRIOR_LENGTH) / np.maximum(distance, 1e-9)
    return np.concatenate([places, np.broadcast_to(scene.ris.center, (trials, 1, 3))], axis=1)


def _gains(spec, center: Floats, tx: Floats, rx: Floats, radio: RadioConfig, factor):  # type: ignore[no-untyped-def]
    """Panel gains (trials, P, cycles) for panels at `center` (trials, P, 3) under codes (trials, cycles, N M)."""
    legs = [leg_response(spec, center, np.broadcast_to(end, center.shape), np.ones(center.shape[:2]), radio.wavelength)
            for end in (tx, rx)]  # fmt: skip
    response = (legs[0] * legs[1]).reshape(*center.shape[:2], -1)
    return response @ np.swapaxes(factor, 1, 2)


def interval(wrong: Floats, trials: int) -> tuple[Floats, Floats]:
    """Clopper-Pearson 95 % interval of an error probability."""
    low = np.where(wrong > 0, beta.ppf(0.025, np.maximum(wrong, 1), trials - wrong + 1), 0.0)
    return low, beta.ppf(0.975, wrong + 1, np.maximum(trials - wrong, 1))


def _row(case: Case, wrong: Floats, trials: int) -> str:
    low, high = interval(wrong, trials)
    at = [min(k, len(wrong)) - 1 for k in (3, 5, 10, 20)]
    shown = " | ".join(f"{wrong[k] / trials:.2g}" for k in at)
    codes = ("changing" if case.changing else "held") + ("" if case.misses else ", misses ignored")
    return (
        f"| {case.scatterers} | {case.snr_db:g} | {case.position_std:g} | {codes} | {trials} | {shown} "
        f"| {low[at[3]]:.1e} to {high[at[3]]:.1e} |"
    )


def draw(found: list[tuple[Case, Floats, int]], file: Path) -> None:
    """Error probability against cycles: by number of scatterers with and without changes of code, by SNR, by place."""
    groups = (
        ("13 dB, 6 cm: scatterers, codes", lambda c: c.snr_db == 13.0 and c.position_std == 0.06 and c.misses),
        ("2 scatterers, 6 cm: reference SNR", lambda c: c.scatterers == 2 and c.position_std == 0.06 and c.changing),
        ("2 scatterers, 13 dB: error of places", lambda c: c.scatterers == 2 and c.snr_db == 13.0 and c.changing),
    )
    with styled():
        figure = Figure(figsize=(13.0, 4.4))
        for axis, (title, chosen) in zip(figure.subplots(1, 3, sharey=True), groups, strict=True):
            shown = [(case, wrong, trials) for case, wrong, trials in found if chosen(case)]
            for number, (case, wrong, trials) in enumerate(sorted(shown, key=lambda one: one[0])):
                _curve(axis, case, wrong, trials, number, title)
            axis.axhline(1e-3, color="black", lw=0.8, ls=":")
            axis.set(yscale="log", ylim=(5e-5, 1.0), xlabel="cycles", title=title, xticks=range(0, 21, 5))
            axis.legend(fontsize=8, loc="upper right" if "codes" not in title else "center right")
        figure.axes[0].set_ylabel("probability of a wrong panel")
        figure.axes[0].annotate("aim", (0.5, 1.1e-3), fontsize=8)
    save_figure(figure, file)


def _curve(axis, case: Case, wrong: Floats, trials: int, number: int, title: str) -> None:  # type: ignore[no-untyped-def]
    """One curve with its interval; where no trial was wrong only the interval's upper end is there."""
    colour = COLOURS[{1: 0, 2: 1, 5: 2}[case.scatterers] if "codes" in title else number]
    label = {
        "13": f"{case.scatterers} scatterer{'s' if case.scatterers > 1 else ''}, "
        f"{'changing' if case.changing else 'held'}",
        "2 ": f"{case.snr_db:g} dB" + ("" if case.misses else ", misses ignored"),
    }[title[:2]]
    if "places" in title:
        label = f"{100.0 * case.position_std:g} cm" + ("" if case.misses else ", misses ignored")
    cycle, share = np.arange(1, len(wrong) + 1), wrong / trials
    low, high = interval(wrong, trials)
    line = "-" if case.changing and case.misses else "--"
    axis.plot(cycle, np.where(share > 0.0, share, np.nan), color=colour, ls=line, lw=1.6, label=label)
    if "codes" in title:  # the others have too few trials: their bands would hide each other
        axis.fill_between(cycle, np.maximum(low, 1e-6), high, color=colour, alpha=0.15, lw=0.0)


if __name__ == "__main__":
    main()
