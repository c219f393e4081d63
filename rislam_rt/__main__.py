"""Entry point of `python -m rislam_rt`: it runs the command line."""

from rislam_rt.cli import main

main()
