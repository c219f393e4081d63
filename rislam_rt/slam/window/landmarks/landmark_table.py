"""The landmark table, what is known besides the place: kind, existence, strength, and whether something hides it."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.panel_evidence import STRENGTHS, panel_rows, ris_probabilities, strength_moments
from rislam_rt.slam.window.landmarks.ris_identification import PanelIdentity


class WindowTable(NamedTuple):
    """F features."""

    ident: Integers
    """(F,) number for life; rows are in its order."""
    is_wall: Booleans
    """(F,)."""
    anchor: Floats
    """(F, 3) [m] the point whose mirror image a wall's three numbers are; unused for points."""
    hits: Integers
    """(F,) cycles with a measurement of it."""
    log_odds: Floats
    """(F,) of its existence."""
    ratio: Floats
    """(F,) log amplitude that a wall leaves of a path; 0 for points."""
    ratio_variance: Floats
    """(F,)."""
    log_grid: Floats
    """(F, G) log posterior of a point's strength (see `panel_evidence`)."""
    log_ris: Floats
    """(F, Q) log odds of each of Q panels against scatterer; of no meaning for walls."""
    hidden: Floats
    """(F, Q + 1) probability that something stands in its way, were it each of the panels, and a scatterer."""
    next_ident: int

    @property
    def points(self) -> Integers:
        """Rows of the points."""
        return (~self.is_wall).nonzero()[0]

    @property
    def walls(self) -> Integers:
        """Rows of the walls."""
        return self.is_wall.nonzero()[0]

    @property
    def ris_probability(self) -> Floats:
        """(F, Q) of being each panel; 0 for walls."""
        return ris_probabilities(self.log_ris, self.points)

    @property
    def identity(self) -> PanelIdentity:
        """(F,) what points are held to be."""
        return PanelIdentity(self.log_grid, self.log_ris, self.hidden)

    @property
    def panels(self) -> tuple[int, ...]:
        """(Q,) row of the point held for each panel, -1 without one."""
        return panel_rows(self.ris_probability)

    @property
    def log_strength(self) -> tuple[Floats, Floats]:
        """Mean and standard deviation (F,) of the log strength of points; 0 for walls."""
        found, points = np.zeros((2, len(self.ident))), self.points
        found[:, points] = strength_moments(self.log_grid[points])
        return found[0], found[1]

    def rows(self, idents: Integers) -> Integers:
        """Rows of features by ident; negative ones (`TX`, `NONE`) stay as they are."""
        place = np.searchsorted(self.ident, idents)
        return np.where(idents < 0, idents, place)


def empty_table(panels: int = 1) -> WindowTable:
    """Nothing known, in a room of so many panels."""
    none, count = np.zeros(0), np.zeros(0, dtype=np.int64)
    return WindowTable(
        count, np.zeros(0, dtype=np.bool_), np.zeros((0, 3)), count, none, none, none,
        np.zeros((0, len(STRENGTHS))), np.zeros((0, panels)), np.zeros((0, panels + 1)), 0,
    )  # fmt: skip


def enter(
    landmarks: WindowTable, is_wall: bool, anchor: Floats, hits: int, log_odds: float, identity: PanelIdentity
) -> WindowTable:
    """The table with one more feature, in the last row; `identity` (1,) of a point."""
    return landmarks._replace(
        ident=np.append(landmarks.ident, landmarks.next_ident),
        is_wall=np.append(landmarks.is_wall, is_wall),
        anchor=np.concatenate([landmarks.anchor, anchor[None]]),
        hits=np.append(landmarks.hits, hits),
        log_odds=np.append(landmarks.log_odds, log_odds),
        ratio=np.append(landmarks.ratio, CONSTANTS.wall_ratio if is_wall else 0.0),
        ratio_variance=np.append(landmarks.ratio_variance, CONSTANTS.wall_ratio_std**2 if is_wall else 0.0),
        **landmarks.identity.join(identity)._asdict(),
        next_ident=landmarks.next_ident + 1,
    )


def idents(landmarks: WindowTable, forms: Integers) -> Integers:
    """Forms (..., 5) of feature rows as forms of idents."""
    if not len(landmarks.ident):
        return forms
    return np.where(forms >= 0, landmarks.ident[np.maximum(forms, 0)], forms)


def image_ident(point: Integers, wall: Integers) -> Integers:
    """Numbers (...,) of the images of points in walls, from the numbers of both."""
    return np.asarray(((point + 1) << 32) + wall)


def remove_features(landmarks: WindowTable, keep: Booleans) -> WindowTable:
    """The table without some of its features."""
    fields: dict[str, Any] = {
        name: getattr(landmarks, name)[keep] for name in landmarks._fields if name != "next_ident"
    }
    return landmarks._replace(**fields)


def learn_ratios(landmarks: WindowTable, walls: Integers, surplus: Floats) -> WindowTable:
    """Walls' log amplitude ratios after returns over walls (N,), louder by `surplus` (N,) than these ratios foresaw."""
    ratio, variance, fading = landmarks.ratio.copy(), landmarks.ratio_variance.copy(), CONSTANTS.fading**2
    for wall, more in zip(walls.tolist(), surplus.tolist(), strict=True):
        gain = variance[wall] / (variance[wall] + fading)
        ratio[wall] += gain * (min(max(ratio[wall] + more, -3.0), 0.1) - ratio[wall])
        variance[wall] = max((1.0 - gain) * variance[wall], fading / 10.0)
    return landmarks._replace(ratio=ratio, ratio_variance=variance)
