"""Points that tracks may be: each as a scatterer and as the panel, by amplitudes and silence over the whole history."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.identity import DOUBT
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.tracks import OTHER, PANEL, UNTOLD
from rislam_rt.slam.window.book import Book
from rislam_rt.slam.window.context import Context
from rislam_rt.slam.window.gauss import poses
from rislam_rt.slam.window.guesses import OVER_RX, OVER_SAME, OVER_TX, POINT, Hypotheses
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.panel import Identity, Sight, spread_places, unknown, weigh
from rislam_rt.slam.window.trial import Fits

ASIDE = 12.0
"""Log evidence behind a track's best point from which on another place is not asked whether it is the panel's."""


def told_panel(context: Context, ats: list[Integers]) -> Floats:
    """(T,) log odds that histories ran over the panel, by alternated codes; 0 where the receiver does not tell."""
    if context.scene.ris is None:
        return np.zeros(len(ats))
    return np.array([DOUBT * np.sum(context.log.side[at] == PANEL) for at in ats], dtype=np.float64)


def identify(
    context: Context, ats: list[Integers], table: Hypotheses, fits: Fits, evidence: Floats
) -> tuple[Floats, Identity]:
    """Gain in log evidence (H,) of points that may be the panel instead of a scatterer, and who each is then."""
    gain, found = np.zeros(len(evidence)), unknown(len(evidence))
    scene, book = context.scene, context.book
    if scene.ris is None:
        found.log_ris[:] = -np.inf
        return gain, found
    point = np.isin(table.kind, (POINT, OVER_RX, OVER_TX, OVER_SAME)) & np.isfinite(evidence)
    taken = np.log1p(-min(float(book.ris_probability.max(initial=0.0)), 1.0 - 1e-6))  # there is but one panel
    for track, at in enumerate(ats):
        rows = (point & (table.trials.track == track)).nonzero()[0]
        if not len(rows) or (context.log.side[at] == OTHER).all():
            continue
        rows = rows[evidence[rows] > evidence[rows].max() - ASIDE]
        fresh = _history(context, at, table, fits, rows)
        fresh = fresh._replace(log_ris=fresh.log_ris + taken)
        gain[rows] = np.logaddexp(0.0, fresh.log_ris) - np.log1p(LEVELS.panels)
        found = found.put(rows, fresh)
    return gain, found


def _history(context: Context, at: Integers, table: Hypotheses, fits: Fits, rows: Integers) -> Identity:
    """Identities of the hypotheses `rows` (R,) of a track whose components are the log's rows `at`."""
    scene, window, log, count = context.scene, context.window, context.log, len(rows)
    place = poses(window)
    ends = poses_of(place[:, :3], context.heading + place[:, 3], scene.body)
    turn, shift = np.swapaxes(table.trials.turn[rows], 2, 3), table.trials.shift[rows]
    spots = spread_places(fits.place[rows], fits.held[rows])
    ratio = _ratio(table, context.book, rows)
    first = context.cycle - window.num_poses + 1
    heard = {int(log.cycle[row] - first): row for row in at}
    found = unknown(count)
    for slot in range(min(heard), window.num_poses):
        row = heard.get(slot, -1)
        amplitude, side = (np.exp(log.log_amplitude[row]), log.side[row]) if row >= 0 else (1.0, UNTOLD)
        tx, rx = (end[slot] @ turn[:, leg] + shift[:, leg] for leg, end in enumerate((ends.tx, ends.rx)))
        sight = Sight(
            spots, tx, rx, ratio, np.full(count, amplitude), np.full(count, side), np.full(count, row >= 0)
        )  # fmt: skip
        found = weigh(found, sight, scene.ris, context.codes[slot], scene.sensor)
    return found


def _ratio(table: Hypotheses, book: Book, rows: Integers) -> Floats:
    """(R,) amplitude that the known walls of hypotheses leave."""
    known, bounces = table.known[rows], np.where(table.kind[rows] == OVER_SAME, 2.0, 1.0)
    return (
        np.asarray(np.exp(np.where(known >= 0, book.ratio[known] * bounces, 0.0)))
        if len(book.ident)
        else np.ones(len(rows))
    )
