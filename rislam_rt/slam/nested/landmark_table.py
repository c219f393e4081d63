"""The table of landmarks: who they are, how often they were seen, how strong they are, and which one is the panel."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.identity import STRENGTHS, panel_rows, ris_probabilities, strength_moments

UNSEEN_RATIO = -0.3
"""Log amplitude ratio expected of a wall before its returns were seen (0.74)."""
RATIO_SPREAD = 0.5
"""Standard deviation of that guess."""
RATIO_NOISE = 0.3
"""Standard deviation of one return's log ratio about the wall's own: angle, estimate of the strength, noise."""


class LandmarkTable(NamedTuple):
    """F features of the map, and the images among them."""

    ident: Integers
    """(F,) number for life."""
    is_wall: Booleans
    """(F,)."""
    anchor: Floats
    """(F, 3) [m] fixed point whose mirror image a wall's three numbers are; unused for points."""
    parent: Integers
    """(F,) ident of the point by which a wall was found, -1 without one."""
    hits: Integers
    """(F,) cycles with a measurement of it."""
    detection_rate: Floats
    """(F, 2) running share of the cycles in which it showed, of those in which it should have: points in the first
    column; walls by single bounces on the Rx leg and on the Tx leg."""
    drift: Floats
    """(F, 3) running mean of the whitened innovations: 0 when all is well, whatever the noise."""
    log_grid: Floats
    """(F, G) log posterior of the strength on the grid; unused for walls."""
    log_ris: Floats
    """(F, Q) log odds of each of Q panels against scatterer, from amplitudes."""
    occlusion: Floats
    """(F, Q + 1) probability that something stands in the way of a point since it last showed, were it each of the
    panels, or a scatterer."""
    ratio: Floats
    """(F,) log amplitude ratio of a wall's reflection."""
    ratio_variance: Floats
    """(F,)."""
    images: Integers
    """(Q, 3) ident of the point, of the wall, and the image's own."""
    image_hits: Integers
    """(Q,)."""
    next_ident: int

    @property
    def points(self) -> Integers:
        """Rows of the table that are points."""
        return (~self.is_wall).nonzero()[0]

    @property
    def walls(self) -> Integers:
        """Rows of the table that are walls."""
        return self.is_wall.nonzero()[0]

    @property
    def ris_probability(self) -> Floats:
        """(F, Q) of each landmark in the table being each panel; 0 for walls."""
        return ris_probabilities(self.log_ris, self.points)

    @property
    def holders(self) -> tuple[int, ...]:
        """(Q,) row of the landmark held for each panel (probability above one half), -1 where none is."""
        return panel_rows(self.ris_probability)

    @property
    def log_strength(self) -> tuple[Floats, Floats]:
        """Mean and standard deviation (F,) of the log strength of each landmark in the table."""
        return strength_moments(self.log_grid)


def empty_table(panels: int = 1) -> LandmarkTable:
    """No landmarks yet, in a room of so many panels."""
    return LandmarkTable(
        np.zeros(0, dtype=np.int64),
        np.zeros(0, dtype=np.bool_),
        np.zeros((0, 3)),
        np.zeros(0, dtype=np.int64),
        np.zeros(0, dtype=np.int64),
        np.zeros((0, 2)),
        np.zeros((0, 3)),
        np.zeros((0, len(STRENGTHS))),
        np.zeros((0, panels)),
        np.zeros((0, panels + 1)),
        np.zeros(0),
        np.zeros(0),
        np.zeros((0, 3), dtype=np.int64),
        np.zeros(0, dtype=np.int64),
        0,
    )


def enter(table: LandmarkTable, is_wall: bool, anchor: Floats, parent: int) -> LandmarkTable:
    """The table with one more feature, in the last row."""
    flat = np.full((1, len(STRENGTHS)), -np.log(len(STRENGTHS)))
    return table._replace(
        ident=np.append(table.ident, table.next_ident),
        is_wall=np.append(table.is_wall, is_wall),
        anchor=np.concatenate([table.anchor, anchor[None]]),
        parent=np.append(table.parent, parent),
        hits=np.append(table.hits, 0),
        detection_rate=np.concatenate([table.detection_rate, np.ones((1, 2))]),
        drift=np.concatenate([table.drift, np.zeros((1, 3))]),
        log_grid=np.concatenate([table.log_grid, flat]),
        log_ris=np.concatenate([table.log_ris, np.full((1, table.log_ris.shape[1]), -np.inf if is_wall else 0.0)]),
        occlusion=np.concatenate([table.occlusion, np.zeros((1, table.occlusion.shape[1]))]),
        ratio=np.append(table.ratio, UNSEEN_RATIO),
        ratio_variance=np.append(table.ratio_variance, RATIO_SPREAD**2),
        next_ident=table.next_ident + 1,
    )


def remove(table: LandmarkTable, keep: Booleans) -> LandmarkTable:
    """The table without some of its features, and without their images."""
    gone = table.ident[~keep]
    stay = ~np.isin(table.images[:, :2], gone).any(axis=1)
    per_feature = table._fields[: table._fields.index("images")]
    fields: dict[str, Any] = {name: getattr(table, name)[keep] for name in per_feature}
    return table._replace(**fields, images=table.images[stay], image_hits=table.image_hits[stay])


def image_idents(table: LandmarkTable, points: Integers, walls: Integers) -> tuple[LandmarkTable, Integers]:
    """Numbers (Q,) in the landmark table of the images of point rows (Q,) in wall rows (Q,), entered if new; their hits
    are counted."""
    row_of = {(point, wall): row for row, (point, wall, _) in enumerate(table.images.tolist())}
    pairs = zip(table.ident[points].tolist(), table.ident[walls].tolist(), strict=True)
    rows = np.array([row_of.setdefault(pair, len(row_of)) for pair in pairs], dtype=np.int64)
    fresh = [[*pair, table.next_ident + at] for at, pair in enumerate(list(row_of)[len(table.images) :])]
    images = np.concatenate([table.images, np.array(fresh, dtype=np.int64).reshape(-1, 3)])
    hits = np.bincount(rows, minlength=len(images))
    hits[: len(table.images)] += table.image_hits
    return table._replace(images=images, image_hits=hits, next_ident=table.next_ident + len(fresh)), images[rows, 2]


def learn_ratio(table: LandmarkTable, wall: int, log_ratio: float) -> LandmarkTable:
    """A wall's log amplitude ratio in the landmark table after one more return."""
    gain = table.ratio_variance[wall] / (table.ratio_variance[wall] + RATIO_NOISE**2)
    ratio, variance = table.ratio.copy(), table.ratio_variance.copy()
    ratio[wall] += gain * (np.clip(log_ratio, -3.0, 0.5) - ratio[wall])
    variance[wall] *= 1.0 - gain
    return table._replace(ratio=ratio, ratio_variance=variance)
