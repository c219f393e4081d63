"""Does the default filter hold in rooms that somebody drew, with furniture, doors, slopes and steps?

The rooms of `benchmarks/scenes/by_hand` were drawn by who had not seen the filter's: a flat, a corridor with door
recesses, an attic with a dormer, an office with partitions, a stepped lecture room, a shop with metal shelves, a
kitchen, a foyer with a curved wall; and once more the shop, where the agent sets out from rest in the middle of an
aisle. One run a room and seed, 20 s, 13 dB, components estimated from samples:
`python benchmarks/filter/by_hand.py --seeds 1 2` (a minute a run).
"""

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOMS = Path(__file__).parents[1] / "scenes" / "by_hand"
COLUMNS = "| room | seed | RMSE / bound | NEES | relative to start [mm] | walls found of heard | ghost walls | lost |"


def score(room: Path, seed: int, folder: Path) -> Mapping[str, Any]:
    """Scores of the only scheme of a run in a room, with the panel's codes optimised if there is one."""
    scheme = "optimized" if "ris" in tomllib.loads((room / "scene.toml").read_text()) else "no_ris"
    out = folder / f"{room.name}-{seed}"
    settings = ("cycles=200", f"seed={seed}", f'schemes=["{scheme}"]')
    words = ["run", "trace_then_slam", "--scene", str(room), "--jobs", "1", "--out", str(out)]
    words += [word for setting in settings for word in ("--set", setting)]
    subprocess.run([sys.executable, "-m", "rislam_rt", *words], check=True, stdout=subprocess.DEVNULL)
    found: Mapping[str, Any] = json.loads((out / "summary.json").read_text())["schemes"][scheme]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", help="names of rooms; all without any")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    wanted = parser.parse_args()
    rooms = [ROOMS / name for name in wanted.rooms] or sorted(path.parent for path in ROOMS.glob("*/scene.toml"))
    print(COLUMNS, "| --- " * COLUMNS.count(" | ") + "| --- |", sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        for room in rooms:
            for seed in wanted.seeds:
                one = score(room, seed, Path(folder))
                walls = f"{one['walls_found']} of {one['walls_heard']}"
                print(
                    f"| {room.name} | {seed} | {one['over_bound']:.2f} | {one['nees_per_dof']:.2f} "
                    f"| {1e3 * one['relative_rmse_m']:.1f} | {walls} | {one['ghost_walls']} "
                    f"| {'yes' if one['true_loss']['lost'] else 'no'} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
