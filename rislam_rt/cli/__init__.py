"""Floor 8: the command line, one file a command. Nothing heavy is imported before a command runs."""

import sys


def main() -> None:
    """Entry point of `rislam-rt`: run a command; a failure that was foreseen is one line and its exit code."""
    from rislam_rt.cli.app import app
    from rislam_rt.errors import RislamError

    try:
        app()
    except RislamError as error:
        print("error: " + " ".join(str(error).split()), file=sys.stderr)
        sys.exit(error.exit_code)
