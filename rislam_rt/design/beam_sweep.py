"""Beam sweep: phase codes for a panel that has not been found yet, over all directions or aimed at a panel candidate.

The paper designs for a panel whose place is known to the filter. Until then an agent that detects nothing of it can
only search: Tx and Rx being one place as the panel sees it, a linear phase over the panel sends what comes from a
direction back into it. Its two-way phase repeats after `lambda / (2 d)` in a direction cosine, so that N x M beams
cover all.
"""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.single_path import exact_code
from rislam_rt.model import RadioConfig, RisCode, RisSpec, SlamEstimate
from rislam_rt.ris import leg_response

MAX_BEAMS = 6
"""Largest number of beams along either axis of the panel: those of larger panels are widened, or the sweep would take
longer than the agent stays."""
HOLD = 3
"""Measurements of a panel candidate up to which the beam that showed it is held: its position is too coarse to aim
at."""
LOOK_ROUND = 4
"""One code in so many goes on with the sweep while a panel candidate is aimed at: if it is the panel, it is silent
then."""
SETTLED = 8
"""Measurements of a panel candidate from which on the sweep goes on beside it."""


def search_code(
    belief: SlamEstimate, ris: RisSpec, radio: RadioConfig, number: int, last: RisCode | None, panel: int = 0
) -> RisCode:
    """Panel code for a panel that the map lacks: aimed at the belief's panel candidate, or the sweep's next beam.

    While the candidate has few measurements the code is `last`, under which it was seen.

    `number` counts codes; `last` is the one before, None at first; `panel` is which of several panels is sought.
    """
    suspect = next((one for one in belief.suspects if one.panel == panel), None)
    if suspect is not None and suspect.hits <= HOLD and last is not None:
        return last
    beams = sweep_codes(ris, radio.wavelength)
    if suspect is None:
        return RisCode(beams[number % len(beams)], ris.levels)
    if suspect.hits >= SETTLED and number % LOOK_ROUND == 0:
        return RisCode(beams[number // LOOK_ROUND % len(beams)], ris.levels)
    legs = [
        leg_response(ris, suspect.position, end, np.ones((), dtype=np.complex128), radio.wavelength)
        for end in belief.body.ends(belief.position, np.array(belief.heading))
    ]
    index, _ = exact_code((legs[0] * legs[1]).ravel(), ris.levels)
    return RisCode(index.reshape(ris.rows, ris.cols), ris.levels)


@lru_cache(maxsize=16)
def sweep_codes(ris: RisSpec, wavelength: float) -> Integers:
    """Phase levels (B, N, M) of the beams of two sweeps over all directions, the second between the first's."""
    along_up, along_right = (
        beam_phases(count, spacing, wavelength)
        for count, spacing in ((ris.rows, ris.spacing[1]), (ris.cols, ris.spacing[0]))
    )
    sweeps = [
        (up[:, None, :, None] + right[None, :, None, :]).reshape(-1, ris.rows, ris.cols)
        for up, right in zip(along_up, along_right, strict=True)
    ]
    response = np.exp(1j * np.concatenate(sweeps))
    levels, _ = exact_code(response.reshape(len(response), -1), ris.levels)
    levels = levels.reshape(response.shape)
    levels.flags.writeable = False
    return levels


def beam_phases(count: int, spacing: float, wavelength: float) -> Floats:
    """Phases (2, B, count) [rad] of a row of elements for B beams evenly over all direction cosines, and for B between.

    With fewer beams than elements each is widened to its share: the phase is quadratic, so that the direction runs
    over the share from one end of the row to the other.
    """
    place = np.arange(count) - (count - 1) / 2.0
    # turns from element to element, from one grazing direction to the other
    width = min(1.0, 4.0 * spacing / wavelength)
    beams = min(int(np.ceil(count * width)), MAX_BEAMS)
    center = width * ((np.arange(beams) + 0.5) / beams - 0.5) + width / beams * np.array([[0.0], [0.5]])
    widened = max(width / beams - 1.0 / count, 0.0) / count
    return 2.0 * np.pi * (center[..., None] * place + 0.5 * widened * place**2)
