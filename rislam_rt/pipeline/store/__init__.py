"""The folder of a run, and the identity that decides whose it is."""
