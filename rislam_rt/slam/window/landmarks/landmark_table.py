"""Landmark table: what the map knows of each feature besides its place: kind, existence, strength, reflectivity,
occlusion."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.panel_evidence import STRENGTHS, panel_rows, ris_probabilities, strength_moments
from rislam_rt.slam.predicted_returns import NONE
from rislam_rt.slam.window.landmarks.ris_identification import PanelIdentity


class _Features(NamedTuple):
    """Kind and existence of F features, reflectivity of walls, strength, panel identity and occlusion of points."""

    ident: Integers
    """(F,) number for life; rows are in its order."""
    is_wall: Booleans
    """(F,) whether it is a wall, else a point."""
    anchor: Floats
    """(F, 3) [m] the point whose mirror image a wall's three numbers are; unused for points."""
    hits: Integers
    """(F,) cycles with a measurement of it."""
    log_odds: Floats
    """(F,) log odds of its existence."""
    ratio: Floats
    """(F,) log amplitude reflection coefficient of a wall; 0 for points."""
    ratio_variance: Floats
    """(F,) variance of that."""
    log_grid: Floats
    """(F, G) log posterior of a point's strength, the root of its cross-section (see `panel_evidence`)."""
    log_ris: Floats
    """(F, Q) log odds of each of Q panels against scatterer; of no meaning for walls."""
    hidden: Floats
    """(F, Q + 1) probability that something occludes it, were it each of the panels, and a scatterer."""
    next_ident: int
    """Number of the next feature."""


class WindowTable(_Features):
    """Landmark table of F features, with what follows from it and is computed once."""

    @cached_property
    def points(self) -> Integers:
        """Rows of the landmark table's features that are points."""
        return (~self.is_wall).nonzero()[0]

    @cached_property
    def walls(self) -> Integers:
        """Rows of the landmark table's features that are walls."""
        return self.is_wall.nonzero()[0]

    @cached_property
    def ris_probability(self) -> Floats:
        """Landmark table's probability (F, Q) that each feature is each of the panels; 0 for walls."""
        return ris_probabilities(self.log_ris, self.points)

    @property
    def identity(self) -> PanelIdentity:
        """Panel identities (F,) of the features in the landmark table; of no meaning for walls."""
        return PanelIdentity(self.log_grid, self.log_ris, self.hidden)

    @cached_property
    def panels(self) -> tuple[int, ...]:
        """Row (Q,) in the landmark table of the point that is held for each panel, -1 where there is none."""
        return panel_rows(self.ris_probability)

    @cached_property
    def log_strength(self) -> tuple[Floats, Floats]:
        """Mean and standard deviation (F,) of the log strength of the landmark table's points; 0 for walls."""
        found, points = np.zeros((2, len(self.ident))), self.points
        found[:, points] = strength_moments(self.log_grid[points])
        return found[0], found[1]

    def rows(self, idents: Integers) -> Integers:
        """Rows of the landmark table for features of given idents; negative ones (`TX`, `NONE`) stay as they are."""
        return np.where(idents < 0, idents, self._row_of[np.maximum(idents, 0)])

    @cached_property
    def _row_of(self) -> Integers:
        """Row in the landmark table of each feature by its ident."""
        found = np.full(max(self.next_ident, 1), NONE)
        found[self.ident] = np.arange(len(self.ident))
        return found


def empty_table(panels: int = 1) -> WindowTable:
    """Landmark table without features, for a room of so many panels."""
    none, count = np.zeros(0), np.zeros(0, dtype=np.int64)
    return WindowTable(
        count, np.zeros(0, dtype=np.bool_), np.zeros((0, 3)), count, none, none, none,
        np.zeros((0, len(STRENGTHS))), np.zeros((0, panels)), np.zeros((0, panels + 1)), 0,
    )  # fmt: skip


def enter(
    landmarks: WindowTable, is_wall: bool, anchor: Floats, hits: int, log_odds: float, identity: PanelIdentity
) -> WindowTable:
    """Landmark table with one more feature in the last row; `identity` (1,) is that of a point."""
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
    """Forms (..., 5) of the landmark table's idents, from forms of its rows."""
    if not len(landmarks.ident):
        return forms
    return np.where(forms >= 0, landmarks.ident[np.maximum(forms, 0)], forms)


def image_ident(point: Integers, wall: Integers) -> Integers:
    """Idents (...,) of the mirror images of the landmark table's points in walls, from the idents of both."""
    return np.asarray(((point + 1) << 32) + wall)


def remove_features(landmarks: WindowTable, keep: Booleans) -> WindowTable:
    """Landmark table with only the features marked in `keep` (F,)."""
    fields: dict[str, Any] = {
        name: getattr(landmarks, name)[keep] for name in landmarks._fields if name != "next_ident"
    }
    return landmarks._replace(**fields)


def learn_ratios(landmarks: WindowTable, walls: Integers, surplus: Floats) -> WindowTable:
    """Kalman update of the log reflection coefficients of walls (N,) by returns over each alone that were louder than
    predicted by `surplus` (N,) in log amplitude."""
    ratio, variance, fading = landmarks.ratio.copy(), landmarks.ratio_variance.copy(), CONSTANTS.fading**2
    for wall, more in zip(walls.tolist(), surplus.tolist(), strict=True):
        gain = variance[wall] / (variance[wall] + fading)
        ratio[wall] += gain * (min(max(ratio[wall] + more, -3.0), 0.1) - ratio[wall])
        variance[wall] = max((1.0 - gain) * variance[wall], fading / 10.0)
    return landmarks._replace(ratio=ratio, ratio_variance=variance)
