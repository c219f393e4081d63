"""Deaths: features that the evidence has turned against leave, with their measurements."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.window import gauss
from rislam_rt.slam.window.book import Book, strike
from rislam_rt.slam.window.expect import Scene
from rislam_rt.slam.window.forms import UNKNOWN
from rislam_rt.slam.window.gauss import Window
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.log import Log, renew


def prune(
    window: Window, book: Book, log: Log, heading: Floats, scene: Scene, cycle: int
) -> tuple[Window, Book, Log]:
    """The map without what does not exist."""
    keep = book.log_odds > np.log(LEVELS.dead / (1.0 - LEVELS.dead))
    if keep.all():
        return window, book, log
    gone = book.ident[~keep]
    lost = np.isin(log.form, gone).any(axis=(1, 2))
    form = log.form.copy()
    form[lost] = UNKNOWN
    log = log._replace(form=form)
    window, book = gauss.drop_features(window, keep), strike(book, keep)
    every = np.arange(window.num_poses)
    for _ in range(2):
        window, _ = renew(window, log, book, scene.body, heading, every)
        window = gauss.solve(window)
    return window, book, log
