"""Fixed-lag smoothing: the Gaussian of the last poses and the map, its motion, and its linear algebra."""
