"""Build the rooms under `scenes/` (and new ones from them): `python -m rislam_rt.scene.build NAME --out DIR`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rislam_rt.errors import RislamError
from rislam_rt.scene.built_in_rooms import ROOMS
from rislam_rt.scene.templates import new_scene


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the named rooms, or all of them, each into its folder below `--out`; returns the exit code."""
    parser = argparse.ArgumentParser(prog="rislam_rt.scene.build", description="Write the built-in rooms.")
    parser.add_argument("name", nargs="+", help=f"'all', or of: {', '.join(ROOMS)}")
    parser.add_argument("--out", type=Path, default=Path("scenes"), help="folder that holds the rooms' folders")
    parser.add_argument("--overwrite", action="store_true", help="replace the files of folders that exist")
    options = parser.parse_args(arguments)
    try:
        for name in list(ROOMS) if options.name == ["all"] else options.name:
            print(new_scene(name, options.out / name, overwrite=options.overwrite))
    except RislamError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
