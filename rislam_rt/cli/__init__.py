"""The command line `rislam-rt`, one file for each command; heavy libraries are imported only when a command runs."""

from rislam_rt.cli.entry_point import main

__all__ = ["main"]
