"""What is a second panel worth, and how soon is each known for what it is? Over seeds, beside one panel alone.

`python benchmarks/panels.py --seeds 10` runs `pipelines/two_panels.toml` on the image-source channel with both panels,
with each alone, and without the codes in turn that set the panels' paths apart; RMSE over the cycles, then over the
seeds. `--figure FILE` draws the first seed's room.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import rislam_rt
from rislam_rt.model import Scene, SlamResult
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.summary import landmark_track, summarise
from rislam_rt.report.room import draw_above
from rislam_rt.report.verdict import panel_found_at
from rislam_rt.shipped import find_pipeline, find_room

HEAD = (
    "room", "codes in turn", "scheme", "agent RMSE [m]", "bound [m]", "association", "panel", "known in",
    "known after [s]: median, largest", "error at the end [m]", "cycles named wrongly",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=240)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    print("| " + " | ".join(HEAD) + " |\n|" + " --- |" * len(HEAD))
    for name, scene, alternation in variants():
        schemes = ["optimized", "random"] + ["no_ris"] * (name == "both")
        keys = [f"schemes={schemes}".replace("'", '"'), "channel=image_source", f"cycles={options.cycles}"]
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
