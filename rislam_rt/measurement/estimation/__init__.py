"""Components from samples: found one by one over a dictionary of delays and angles, then refined together."""
