"""`python -m rislam_rt.cli`."""

from rislam_rt.cli import main

main()
