"""Beam sweep: phase codes for a panel that has not been found yet, over all directions or aimed at a panel candidate.

The paper designs for a panel whose place is known to the filter. Until then an agent that detects nothing of it can
only search: Tx and Rx being one place as the panel sees it, a linear phase over the panel sends what comes from a
direction back into it. Its two-way phase repeats after `lambda / (2 d)` in a direction cosine, so that N x M beams
cover all. Noise passes for a panel that a beam has lit in every cycle or so. So a panel candidate is followed only as
far as that is likelier to succeed than to go on searching is (search theory: Koopman 1980, Search and Screening).
"""

from collections import Counter, defaultdict
from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.single_path import exact_code
from rislam_rt.model import PanelCandidate, RadioConfig, RisCode, RisSpec, SlamEstimate
from rislam_rt.ris import leg_response

MAX_BEAMS = 6
"""Largest number of beams along either axis of the panel: those of larger panels are widened, or the sweep would take
longer than the agent stays."""
HOLD, AIM, GO_ON = 0, 1, 2
"""What a search may do about a candidate: hold the code that lit it, aim at it, go on with the sweep."""


class BeamSweep:
    """A sweep over all directions that goes on from code to code, for each of several panels."""

    def __init__(self) -> None:
        self.sent: Counter[int] = Counter()
        """Number of the beams sent so far for each panel."""
        self.turns: defaultdict[int, list[int]] = defaultdict(lambda: [HOLD, AIM, GO_ON])
        """What is done with each panel's candidate by turns, what was done last at the end."""

    def beam(self, ris: RisSpec, radio: RadioConfig, panel: int = 0) -> RisCode:
        """The sweep's next beam for a panel."""
        beams = sweep_codes(ris, radio.wavelength)
        self.sent[panel] += 1
        return RisCode(beams[(self.sent[panel] - 1) % len(beams)], ris.levels)


def search_code(
    belief: SlamEstimate, ris: RisSpec, radio: RadioConfig, sweep: BeamSweep, panel: int = 0, lit: RisCode | None = None
) -> RisCode:
    """Panel code for a panel that the map lacks: the one under which it is likeliest to be heard, and known for it.

    That is the sweep's next beam, or the code that last lit the belief's panel candidate, or one that is aimed at it.
    If the candidate is not the panel's direct path, one beam of all lights that path. If it is, and nothing hides it,
    the code that lit it may do so again, and an aimed one lights the places at which it gives half of the power or
    more. All three take turns where what it is was asked in vain, or where the receiver does not tell it from a
    scatterer, which any code lights: what is heard under a beam as well is no panel.

    `panel` is which of several panels is sought, and `lit` the candidate's code for this panel.
    """
    found = next((one for one in belief.suspects if one.panel == panel), None)
    if found is None:
        return sweep.beam(ris, radio, panel)
    code, share = _aimed(found, belief, ris, radio)
    panel_there = found.real * found.is_panel
    known = panel_there * found.clear * (1.0 if found.told else found.is_panel)
    new = (1.0 - panel_there) / len(sweep_codes(ris, radio.wavelength))
    again = known * found.again if lit is not None else 0.0
    aimed = known * share
    if max(again, aimed) <= new:
        return sweep.beam(ris, radio, panel)
    turns, may = sweep.turns[panel], {HOLD: again > new, AIM: aimed > new, GO_ON: True}
    if found.told and not found.examined:
        may = {HOLD: again >= aimed, AIM: again < aimed, GO_ON: False}
    turn = next(each for each in turns if may[each])
    turns.append(turns.pop(turns.index(turn)))
    if turn == HOLD and lit is not None:
        return lit
    return code if turn == AIM else sweep.beam(ris, radio, panel)


def _aimed(found: PanelCandidate, belief: SlamEstimate, ris: RisSpec, radio: RadioConfig) -> tuple[RisCode, float]:
    """Code aimed at a panel candidate, and the share of the places at which it may be that get half of the power."""
    places = np.concatenate([found.position[None], found.samples])
    one = np.ones(len(places), dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore"):  # a candidate may lie on the agent
        tx, rx = (
            leg_response(ris, places, end, one, radio.wavelength)
            for end in belief.body.ends(belief.position, np.array(belief.heading))
        )
        response = np.nan_to_num((tx * rx).reshape(len(places), -1))
    index, best = exact_code(response[0], ris.levels)
    gain = np.abs(response[1:] @ np.exp(-2j * np.pi / ris.levels * index))
    share = float(np.mean(gain**2 >= 0.5 * best**2)) if best > 0.0 else 0.0
    return RisCode(index.reshape(ris.rows, ris.cols), ris.levels), share


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
