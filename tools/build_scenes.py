"""Build the rooms under `scenes/`, which come with the package: `python tools/build_scenes.py NAME ... --out DIR`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from built_in_rooms import ROOMS

from rislam_rt.errors import RislamError
from rislam_rt.scene.room_files import room_files
from rislam_rt.scene.write import write_files


def built_files(name: str) -> dict[str, bytes]:
    """The files of a built-in room, by relative name."""
    return room_files(ROOMS[name](), f"Written by `python tools/build_scenes.py {name}`.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the named rooms, or all of them, each into its folder below `--out`; returns the exit code."""
    parser = argparse.ArgumentParser(description="Write the rooms that come with the package.")
    parser.add_argument(
        "name", nargs="+", choices=["all", *ROOMS], metavar="NAME", help=f"'all', or of: {', '.join(ROOMS)}"
    )
    parser.add_argument("--out", type=Path, default=Path("scenes"), help="folder that holds the rooms' folders")
    parser.add_argument("--overwrite", action="store_true", help="replace the files of folders that exist")
    options = parser.parse_args(arguments)
    try:
        for name in list(ROOMS) if options.name == ["all"] else options.name:
            print(write_files(built_files(name), options.out / name, overwrite=options.overwrite))
    except RislamError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
