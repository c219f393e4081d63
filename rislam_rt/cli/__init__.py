"""Floor 9: the command line, one file a command. Nothing heavy is imported before a command runs."""

from rislam_rt.cli.entry_point import main

__all__ = ["main"]
