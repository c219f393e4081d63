"""`python -m rislam_rt`."""

from rislam_rt.cli import main

main()
