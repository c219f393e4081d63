"""Numerics: steps of the solver and limits of what is worth a look.

Some belong to the model and are not in its table: `EDGE`, `ALIGNED`, `LATELY`, `MISSED`.
"""

import numpy as np

GATE = 16.3
"""Squared Mahalanobis distance of delay and cosines beyond which nothing associates (chi^2, 3 dof: 0.999)."""
REFRESH = 5
"""Cycles between two re-linearisations of the whole window."""
DAMPING = 0.3
"""Share of the new in each step's log precision."""
STEPS = 4
"""Gauss-Newton steps: the first guesses are within the linear range of the truth."""
HOPELESS = 30.0
"""Log likelihood behind the best hypothesis of a track from which on one is not followed."""
RIDGE = 1e-3
"""Information [1/m^2] that keeps blind directions finite: (30 m)^-2."""
POINTS = 8
"""Most normal points of a history."""
NEAR = np.array([0.3, 0.15, 0.15])
"""Gap in length [m] and cosines up to which a return of the map is weighed as a track's explanation."""
MOST = 2
"""Explanations of one track by the map that are weighed, the nearest."""
STRIDE = 3
"""Cycles between two examinations."""
NEARBY = 2.0
"""Distance [m] beyond which two places are not compared."""
LATELY = 5
"""Last steps that may all have been as lively as can be: what began within half a second."""
MISSED = 1.5
"""Standard deviations by which fewer returns show than should, from which on a jump is looked for."""
DRAWS = 12
"""Places of the belief over which the panel's predicted gain is averaged."""
CERTAIN = 30.0
"""Log odds beyond which an identity is no longer in question."""
FEWEST = 15
"""Measurements of a feature within the window from which on their residuals speak against it."""
RECENT = 5
"""Cycles within which a form must have been seen for its measurements to go on as a track."""
FAINT = 0.5
"""SNR below which a return is not looked for: it moves nothing in its cell by more than the noise does."""
EDGE = 1.15
"""Distance in cells up to which a weaker path moves a stronger one: cells have no sharp edge."""
LOUDEST = 1e3
"""Mean square of a residual in reported deviations beyond which it counts no more: 30 dB of SNR beside it."""
MODES = 7
"""Motion modes, half a decade apart."""
ALIGNED = 0.2
"""Share of the paths over unknown walls that have them on the Tx leg alone."""
STILL = 1e-5
"""[m/s^2] Acceleration of an axis that is known to be still."""
ASTRAY = 0.3
"""[m] by which a step of a fit may go where nothing is measured."""
BEARINGS = 8
"""Initial values, all around, of an upright wall whose bearing only a length tells."""
REACH = 5.0
"""Standard deviations by which a track may come from elsewhere than the point of which it may be an image."""
APART = 0.5
"""Distance [m] between two fits of one kind below which they are one."""
STEP = 1e-6
"""[m] by which walls are moved for the slope of a margin: its second derivative is of the order of one over metres."""
PERIODS = 3
"""Most periods of the sounding by which a path may be longer than it is heard: 115 m at 128 tones over 1 GHz."""
STRENGTHS = 13
"""Strengths of a neighbour over which a track's expected scatter is averaged."""
