"""Fixed-lag smoother: the Gaussian of the last K poses and the map, its motion model, and its linear algebra."""
