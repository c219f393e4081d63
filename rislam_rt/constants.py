"""Physical constants, and geometric tolerances that several folders must agree on."""

import math

SPEED_OF_LIGHT = 299_792_458.0
"""Speed of light in vacuum [m/s] (exact, SI)."""

MAX_SPEED = 10.0
"""Largest speed [m/s] of an agent indoors; more is a wrong unit."""

MAX_START_HEADING = 8.0 * math.pi
"""Largest heading [rad] of either sign that an agent is told at the start: three turns, as a recorded one may have, and
one for errors of its compass; more is degrees."""

SURFACE_TOLERANCE = 1e-6
"""Distance [m] below which a point counts as lying on a facet; coordinates are metres in float64."""

COPLANAR_ANGLE = 1e-4
"""Triangles of one reflector within this angle [rad] of each other (and `COPLANAR_OFFSET`) form one wall."""

COPLANAR_OFFSET = 1e-4
"""Distance [m] between two triangles' planes below which they are the same wall; PLY files hold float32."""

RAY_OFFSET = 6e-6
"""Sionna RT starts a ray off its surface by this much of (1 m + the largest coordinate): 100 float32 roundings."""
