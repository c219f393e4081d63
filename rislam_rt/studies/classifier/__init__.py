"""Training of the classifier of multipath components (landmark or wall return), and its test in other rooms."""
