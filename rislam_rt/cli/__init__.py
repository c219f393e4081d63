"""Floor 8: the command line, one file a command. Nothing heavy is imported before a command runs."""

import os
import sys


def main() -> None:
    """Entry point of `rislam-rt`: run a command; a failure that was foreseen is one line and its exit code."""
    # One thread: the matrices are small, and sums in one order give the same bits on every machine.
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    import typer

    from rislam_rt.cli.app import app
    from rislam_rt.errors import RislamError

    try:
        code = app(sys.argv[1:] or ["--help"], prog_name="rislam-rt", standalone_mode=False)
    except RislamError as error:
        _leave(str(error), error.exit_code)
    except typer.Abort:
        _leave("interrupted", 130)
    except Exception as error:
        # Wrong usage: the parser's exceptions have no public base class, but all can say what is wrong.
        if not hasattr(error, "format_message"):
            raise
        _leave(f"{error.format_message()}; see rislam-rt --help", 2)
    else:
        sys.exit(code if isinstance(code, int) else 0)


def _leave(message: str, code: int) -> None:
    print("error: " + " ".join(message.split()), file=sys.stderr)
    sys.exit(code)
