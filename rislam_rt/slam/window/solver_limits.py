"""Numerical limits of the window filter: solver steps, gates, and bounds beyond which an alternative is not examined.

Some belong to a model and not here: docs/slam.md, `Numbers beside the constants`, says which.
"""

import numpy as np

GATE = 16.3
"""Squared Mahalanobis distance of delay and cosines beyond which nothing associates (chi^2, 3 dof: 0.999)."""
REFRESH = 5
"""Cycles between two re-linearisations of the whole window."""
DAMPING = 0.3
"""Weight of the new value in each update of a step's log acceleration precision."""
STEPS = 4
"""Gauss-Newton steps of a hypothesis's fit: initial values are within the linear range of the truth."""
POINTS = 8
"""Most normal points to which a track's history is condensed."""
NEAR = np.array([0.3, 0.15, 0.15])
"""Gap in length [m] and cosines up to which a predicted return of the map is weighed as a track's explanation."""
MOST = 2
"""Most predicted returns of the map, the nearest, that are weighed as explanations of one track."""
STRIDE = 3
"""Cycles between two examinations of tracks for births, and of returns for a climb."""
NEARBY = 2.0
"""Distance [m] beyond which two hypothetical features are not compared."""
LATELY = 5
"""Number of last steps that a manoeuvre may cover: one that began within half a second."""
LASTED = np.array([3, 5, 10, 20])
"""Numbers of last steps over which a manoeuvre is looked for that only tracks tell of."""
CLIMBED = 10
"""Number of last steps over which a climb is looked for that returns tell of."""
BEGUN = np.array([20, 10])
"""Numbers of steps ago, beside all of the window's, at which a heave, or a floor that is not level, may have begun."""
AGO = np.array([0, 3, 5, 10, 20])
"""Numbers of steps ago at which a lively segment may have begun or ended."""
DRAWS = 12
"""Samples of a place over which a panel's predicted gain is averaged."""
CERTAIN = 30.0
"""Log odds beyond which nothing is in doubt, at a probability of 1e-13: those of identities and direction priors are
clipped to it, and what is as far behind a track's best hypothesis is not asked for anything more."""
FEWEST = 15
"""Measurements of a feature within the window from which on their residuals may remove it."""
FAINT = 0.5
"""Integrated SNR below which a return is not predicted: it moves nothing in its cell by more than the noise does."""
EDGE = 1.15
"""Distance in resolution cells up to which a weaker path moves a stronger one: cells have no sharp edge."""
MODES = 7
"""Number of motion modes, half a decade of acceleration apart."""
ALIGNED = 0.2
"""Share of the paths over unknown walls that have them on the Tx leg alone, and so keep their direction of arrival."""
STILL = 1e-5
"""What stands for zero: [m/s^2] of an axis that is known not to move, [m/s] least deviation of a rate of length."""
TOLD = 1e-4
"""[m] standard deviation of a start's position that is held exactly, as far as rounding of the solution lets it."""
ASTRAY = 0.3
"""[m] by which a step of a fit may go along directions of which a length alone, or an angle's square, tells nothing."""
BEARINGS = 8
"""Number of initial bearings, all around, of an upright wall of which only a path length tells."""
REACH = 5.0
"""Standard deviations of direction within which a track may be an image of a point on the Tx leg."""
APART = 0.5
"""Distance [m] between two fits of one kind below which they are the same solution."""
STEP = 1e-6
"""[m] step of the finite differences of a path's margins by its walls: second derivatives are of the order of one over
metres."""
PERIODS = 3
"""Most periods of the sounding that an ambiguous delay may hide of a path's length: 115 m at 128 tones over 1 GHz."""
STRENGTHS = 13
"""Number of strengths of an unresolved neighbour over which a track's expected scatter is averaged."""
SWAYS = 5
"""Number of levels of the body's attitude, half a decade of angle apart."""
HEAVES = np.array([0.0, 1e-3, 3e-3, 1e-2, 3e-2])
"""Standard deviations [m] of the body's heave: none, and up to what a walker's hand or hip does."""
PRIORS = 5
"""Number of priors of the vertical motion that are compared, from an uneven floor to what each step alone asks for."""
