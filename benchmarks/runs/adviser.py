"""Does a run hear what `rislam-rt check` said it would? And does a trace take as long?

    python benchmarks/runs/adviser.py            ten rooms, 100 cycles each, image sources, two bounces; 2 minutes
    python benchmarks/runs/adviser.py --cost     seconds foretold and taken by the traced channel, six rooms, 600 cycles

For every landmark the share of the cycles in which the adviser expects a component of it, beside the share in which the
run's receiver reported one (true identities, scoring only). Aimed codes are those of the scheme `genie` with the exact
designer, which knows the truth; random codes those of `random`. Then `optimized`, whose agent has to find the panel
first; and the panel that the adviser proposes instead of one that is too weak, tried in a run of `genie`. Random rooms
are development ones (`rislam-rt new --seed`); seed 1.
"""

import argparse
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

import rislam_rt
from rislam_rt.adviser.advice import Advice, advise
from rislam_rt.adviser.remedies import HEARD, SELDOM
from rislam_rt.adviser.tracing_cost import trace_cost
from rislam_rt.model import Scene, SchemeResult, SlamResult
from rislam_rt.pipeline import PipelineSpec, build_radio, load_spec
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.report.conclusions import panel_found_at
from rislam_rt.scene.random_rooms import draw_room

CYCLES, SEED = 100, 1
ROOMS = (
    ("paper_room", 13.0), ("paper_room", -10.0), ("office", 0.0), ("large_hall", 0.0), ("shaded_room", 13.0),
    ("tilted_room", 0.0), ("201", 13.0), ("203", 13.0), ("205", 0.0), ("208", 0.0),
)  # fmt: skip
"""Rooms by name, or by the number of a random one, and the reference SNR [dB] that each is run at."""
COSTED = ("empty_box", "paper_room", "office", "shaded_room", "large_hall", "tilted_room")
PIPELINE = Path(__file__).parents[2] / "pipelines" / "trace_then_slam.toml"


class Row(NamedTuple):
    """One landmark under one kind of codes."""

    landmark: str
    codes: str
    margin_db: float
    """Median over the places that have a path."""
    foretold: float
    heard: float


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cost", action="store_true", help="seconds of a trace instead")
    if parser.parse_args().cost:
        compare_costs()
    else:
        compare_hearing()


def compare_hearing() -> None:
    """What was foretold of each landmark, and what a run heard."""
    rows: list[Row] = []
    print(
        "| room, SNR | landmark | codes | margin [dB] | foretold | heard | same word | `optimized` found it | larger |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, snr in ROOMS:
        scene = draw_room(int(name)).scene if name.isdigit() else rislam_rt.load_scene(name)
        scene = replace(scene, agent=scene.agent[:CYCLES])
        schemes = '["genie", "random", "optimized"]' if scene.ris else '["no_ris"]'
        changed = [
            "receiver.estimator=bound", "receiver.alternation=false", f"radio.reference_snr_db={snr}",
            "channel=image_source", f"schemes={schemes}", "design.method=exact",
        ]  # fmt: skip
        spec = load_spec(PIPELINE, changed)
        advice = advise(scene, build_settings(spec), rng=np.random.default_rng(SEED))
        result = rislam_rt.run_slam(scene, spec, rng=np.random.default_rng(SEED))
        for row in compare_room(scene, advice, result):
            rows.append(row)
            found = found_words(scene, result, row)
            same = "yes" if word(row.foretold) == word(row.heard) else "**no**"
            print(
                f"| {name}, {snr:g} dB | {row.landmark} | {row.codes} | {row.margin_db:+.1f} | {row.foretold:.0%} | "
                f"{row.heard:.0%} | {same} | {found} | "
                f"{larger_words(scene, spec, advice, row)} |", flush=True,
            )  # fmt: skip
        for line in advice.remedies:
            print(f"<!-- {name}: {line} -->")
    gap = np.array([row.foretold - row.heard for row in rows])
    same = sum(word(row.foretold) == word(row.heard) for row in rows)
    print(f"\n{len(rows)} rows: same word in {same}; difference of shares: RMS {np.sqrt(np.mean(gap**2)):.3f}, "
          f"mean {gap.mean():+.3f}, largest {np.abs(gap).max():.2f}")  # fmt: skip


def compare_room(scene: Scene, advice: Advice, result: SlamResult) -> Iterator[Row]:
    """One row for each link of which a run has the codes."""
    for link in advice.links:
        name = {"aimed": "genie", "random": "random", "": "genie"}.get(link.code)
        if name is None:
            continue
        scheme = result.schemes[name] if scene.ris else result.schemes["no_ris"]
        there = link.margin_db[link.margin_db > -300.0]
        margin = float(np.median(there)) if len(there) else float("-inf")
        yield Row(
            link.landmark, link.code or "any", margin, link.share, heard_share(scene, result, scheme, link.landmark)
        )


def heard_share(scene: Scene, result: SlamResult, scheme: SchemeResult, landmark: str) -> float:
    """Share of the cycles with a component of the landmark."""
    path = scheme.component_path
    owner = np.where(path >= 0, result.paths.landmark[np.maximum(path, 0)], -1)
    return float(np.mean((owner == scene.landmarks.index(landmark)).any(axis=1)))


def found_words(scene: Scene, result: SlamResult, row: Row) -> str:
    """When the agent that knows nothing of the panel's place had it in its map."""
    if row.codes != "aimed":
        return ""
    at = panel_found_at(result, result.schemes["optimized"])
    share = heard_share(scene, result, result.schemes["optimized"], row.landmark)
    return f"{'no' if at is None else f'after {at:.1f} s'}, heard {share:.0%}"


def larger_words(scene: Scene, spec: PipelineSpec, advice: Advice, row: Row) -> str:
    """What a run hears of the panel that the adviser proposes instead, if it proposes one."""
    line = next((one for one in advice.remedies if one.startswith(f"{row.landmark}: ")), "")
    size = re.search(r"or a panel of (\d+) x (\d+) elements", line)
    if row.codes != "aimed" or size is None:
        return ""
    room = spec.room.model_copy(update={"panel_rows": int(size[1]), "panel_cols": int(size[2])})
    larger = spec.model_copy(update={"room": room, "schemes": ["genie"]})
    result = rislam_rt.run_slam(scene, larger, rng=np.random.default_rng(SEED))
    share = heard_share(scene, result, result.schemes["genie"], row.landmark)
    return f"{size[1]} x {size[2]}: heard {share:.0%}"


def word(share: float) -> str:
    """As `remedies.verdict` has it."""
    return "heard" if share >= HEARD else "at times" if share >= SELDOM else "not heard"


def compare_costs() -> None:
    """Seconds of processor time foretold and taken."""
    radio = build_radio(load_spec(PIPELINE).radio)
    build_channel("traced", rislam_rt.load_scene("empty_box"), radio, 1)  # the tracer's import
    print("| room | walls | bounces | wall sequences | paths | foretold [s] | taken [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in COSTED:
        scene = rislam_rt.load_scene(name)
        walls = len(build_channel("image_source", scene, radio, 0).walls)  # type: ignore[attr-defined]
        for cost in trace_cost(scene, radio, walls):
            if cost.seconds is None:
                continue
            channel = build_channel("traced", scene, radio, cost.depth)
            start = process_time()
            channel.paths(scene.agent)
            print(f"| {name} | {cost.walls} | {cost.depth} | {cost.sequences} | {cost.paths} | {cost.seconds:.2f} | "
                  f"{process_time() - start:.2f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
