"""Training of the classifier of multipath components, on some rooms, and its score on others."""
