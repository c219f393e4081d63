"""What is a second panel worth, and how soon is each known for what it is? Over seeds, beside one panel alone.

`python benchmarks/filter/panels.py --seeds 10` runs `pipelines/two_panels.toml` on the image-source channel with both
panels, with each alone, and without the codes in turn that set the panels' paths apart; RMSE over the cycles, then over
the seeds. `--figure FILE` draws the first seed's room; `--double` says how strong paths from panel to panel are.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import rislam_rt
from rislam_rt.arrays import Complexes
from rislam_rt.model import RadioConfig, Scene, SlamResult
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.scores.summary import landmark_track, summarise
from rislam_rt.report.conclusions import panel_found_at
from rislam_rt.report.map_from_above import draw_above
from rislam_rt.ris import leg_response
from rislam_rt.ris.response import element_gain_area, element_pattern
from rislam_rt.shipped import find_pipeline, find_room

HEAD = (
    "room", "codes in turn", "scheme", "agent RMSE [m]", "bound [m]", "association", "panel", "known in",
    "known after [s]: median, largest", "error at the end [m]", "cycles named wrongly",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=240)
    parser.add_argument("--snr", type=float, default=13.0, help="radio.reference_snr_db")
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--double", action="store_true", help="the strength of paths from panel to panel, alone")
    options = parser.parse_args()
    if options.double:
        print_double_reflection(rislam_rt.load_scene(find_room("two_panels")), RadioConfig())
        return
    print("| " + " | ".join(HEAD) + " |\n|" + " --- |" * len(HEAD))
    for name, scene, alternation in variants():
        schemes = ["optimized", "random"] + ["no_ris"] * (name == "both")
        keys = [f"schemes={schemes}".replace("'", '"'), "channel=image_source", f"cycles={options.cycles}"]
        keys += [f"radio.reference_snr_db={options.snr}", "receiver.estimator=bound"]
        spec = load_spec(find_pipeline("two_panels"), [*keys, f"receiver.alternation={str(alternation).lower()}"])
        runs = [rislam_rt.run_slam(scene, spec, rng=np.random.default_rng(seed)) for seed in range(options.seeds)]
        if options.figure is not None and name == "both" and alternation:
            draw_above(runs[0]).savefig(options.figure, dpi=110)
        for scheme in schemes:
            for row in rows_of(runs, scheme):
                print("| " + " | ".join([name, "yes" if alternation else "no", scheme, *row]) + " |", flush=True)


def variants() -> Iterator[tuple[str, Scene, bool]]:
    """Room, and whether codes take turns."""
    room = rislam_rt.load_scene(find_room("two_panels"))
    yield "both", room, True
    for panel in room.panels:
        yield f"`{panel.name}` alone", replace(room, ris=panel), True
    yield "both", room, False


def rows_of(runs: list[SlamResult], scheme: str) -> Iterator[list[str]]:
    """One row for each panel, the agent's numbers in the first; one for none."""
    entries = [summarise(run)["schemes"][scheme] for run in runs]
    rmse, bound = (np.sqrt(np.mean([entry[name] ** 2 for entry in entries])) for name in ("rmse_m", "bound_m"))
    agent = [f"{rmse:.4f}", f"{bound:.4f}", f"{np.mean([entry['association']['accuracy'] for entry in entries]):.2f}"]
    panels = runs[0].scene.panels if runs[0].schemes[scheme].levels else ()
    if not panels:
        yield [*agent, *("-" * 5)]
    for number, panel in enumerate(panels):
        when = [panel_found_at(run, run.schemes[scheme], number) for run in runs]
        known = [time for time in when if time is not None]
        final = [entry["landmarks"][panel.name]["final_m"] for entry in entries]
        error = np.sqrt(np.mean([value**2 for value in final if value is not None])) if any(final) else np.nan
        times = f"{np.median(known):.1f}, {max(known):.1f}" if known else "-"
        wrong = sum(named_wrongly(run, scheme, number) for run in runs)
        yield [*(agent if not number else [""] * 3), panel.name, f"{len(known)} of {len(runs)}", times, f"{error:.3f}",
               str(wrong)]  # fmt: skip


def print_double_reflection(scene: Scene, radio: RadioConfig) -> None:
    """Paths from panel to panel, which no channel here has: the best that codes for nothing else could make of them.

    The gain of Tx, one panel, the other, Rx is bilinear in the two codes: raised in turn with continuous phases, from
    five random codes. `sure` is the sum of the moduli of all its terms, which no code exceeds.
    """
    one, other = scene.panels
    places = [(panel.center + panel.spec.offsets()).reshape(-1, 3) for panel in (one, other)]
    span = places[1][None] - places[0][:, None]
    length = np.linalg.norm(span, axis=-1)
    pattern = [element_pattern(p.spec, s * (span @ p.spec.normal) / length) for p, s in ((one, 1.0), (other, -1.0))]
    # a leg from element to element: half the join of either panel, as `leg_response` has it
    join = [np.sqrt(4.0 * np.pi * element_gain_area(p.spec, radio.wavelength)) * p.spec.amplitude / radio.wavelength
            for p in (one, other)]  # fmt: skip
    turn = np.exp(-2j * np.pi / radio.wavelength * length)
    between = np.sqrt(pattern[0] * pattern[1] * join[0] * join[1]) * radio.wavelength / (4.0 * np.pi * length) * turn
    direct, double, sure = [], [], []
    for cycle in range(0, len(scene.agent), 20):
        ends = scene.agent.tx[cycle], scene.agent.rx[cycle]
        legs = [[leg_response(p.spec, p.center, end, np.ones(()), radio.wavelength).ravel() for end in ends]
                for p in (one, other)]  # fmt: skip
        direct.append([np.abs(tx * rx).sum() for tx, rx in legs])
        terms = legs[0][0][:, None] * between * legs[1][1]
        double.append(best_bilinear(terms, np.random.default_rng(cycle)))
        sure.append(np.abs(terms).sum())
    level = 20.0 * np.log10(np.array([np.max(direct), np.max(double), np.max(sure)]))
    below = 20.0 * np.log10(np.min(np.max(direct, axis=1) / np.array(double)))
    print(
        f"direct {level[0]:.1f} dB at most; panel to panel {level[1]:.1f} dB at most (no code above {level[2]:.1f} dB)"
    )
    print(f"at least {below:.1f} dB below the stronger direct path")


def best_bilinear(terms: Complexes, rng: np.random.Generator) -> float:
    """Largest modulus of x' terms y over phases x, y that raising either in turn finds."""
    best = 0.0
    for _ in range(5):
        second = np.exp(2j * np.pi * rng.uniform(size=terms.shape[1]))
        for _ in range(30):
            first = np.exp(-1j * np.angle(terms @ second))
            second = np.exp(-1j * np.angle(first @ terms))
        best = max(best, float(abs(first @ terms @ second)))
    return best


def named_wrongly(run: SlamResult, scheme: str, panel: int) -> int:
    """Cycles in which another landmark, or a point that is none, is held for a panel."""
    named = run.schemes[scheme].named(panel)
    column = landmark_track(run.scene, run.schemes[scheme]).column[:, len(run.scene.scatterers) + panel]
    right = np.zeros(named.shape, dtype=np.bool_)
    held = np.flatnonzero(column >= 0)
    right[held, column[held]] = True
    return int((named & ~right).any(axis=1).sum())


if __name__ == "__main__":
    main()
