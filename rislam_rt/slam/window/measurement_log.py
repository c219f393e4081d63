"""Log of the window's measurements, and what each is held to be."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN


class Log(NamedTuple):
    """N components, in the order of their cycles."""

    cycle: Integers
    """(N,)."""
    seen: Floats
    """(N, 3) length [m] and two cosines."""
    std: Floats
    """(N, 3)."""
    log_amplitude: Floats
    """(N,)."""
    log_amplitude_std: Floats
    """(N,)."""
    side: Integers
    """(N,) (see `slam.observations`)."""
    track: Integers
    """(N,) ident of the track that it belongs to, -1 for none."""
    form: Integers
    """(N, 2, 5) feature idents of the form that it is, and of the partner that it came out as one with; the base is
    `UNKNOWN` where there is none."""
    share: Floats
    """(N,) of the partner in its place."""
    extra: Floats
    """(N, 3) variance beyond the reported one..."""
    shared: Floats
    """(N, 3) ...and its part by what the map knows in the component's cell: the rest is scatter."""

    def take(self, rows: Any) -> "Log":
        """Only some of the components."""
        return Log._make(field[rows] for field in self)

    def explain(
        self, rows: Integers, forms: Integers, share: Floats | float, shared: Floats | float, scatter: Floats
    ) -> "Log":
        """With rows (A,) held to be forms (A, 2, 5) of idents, with the partners' shares (A,) and variances (A, 3): by
        what the map knows in their cells, and by scatter."""
        form, shares, variance, known = self.form.copy(), self.share.copy(), self.extra.copy(), self.shared.copy()
        form[rows], shares[rows], variance[rows], known[rows] = forms, share, shared + scatter, shared
        return self._replace(form=form, share=shares, extra=variance, shared=known)

    @property
    def momentary(self) -> Floats:
        """(N, 3) variance of one cycle's measurement by itself: scatter counts `memory` times in `extra`, as its pull
        keeps its sign for as long."""
        return np.asarray(self.std**2 + self.shared + (self.extra - self.shared) / CONSTANTS.memory)

    @property
    def explained(self) -> Booleans:
        """(N,) whether it is held to be a form."""
        return np.asarray(self.form[:, 0, 0] != UNKNOWN)


def empty_log() -> Log:
    """No components."""
    none, count = np.zeros(0), np.zeros(0, dtype=np.int64)
    wide = np.zeros((0, 3))
    return Log(count, wide, wide, none, none, count, count, np.zeros((0, 2, 5), dtype=np.int64), none, wide, wide)


def append(log: Log, observed: Observations, cycle: int, first: int) -> Log:
    """The log with a cycle's components, unexplained as yet, and without those before cycle `first`."""
    count, old = len(observed.seen), log.take(slice(np.searchsorted(log.cycle, first), None))
    fresh = Log(
        np.full(count, cycle), observed.seen, observed.std, observed.log_amplitude, observed.log_amplitude_std,
        observed.sides,
        np.full(count, -1), np.full((count, 2, 5), UNKNOWN), np.zeros(count), np.zeros((count, 3)),
        np.zeros((count, 3)),
    )  # fmt: skip
    return Log(*(np.concatenate(pair) for pair in zip(old, fresh, strict=True)))


class Residuals(NamedTuple):
    """A components that are held to be forms."""

    row: Integers
    """(A,) in the log."""
    slot: Integers
    """(A,) pose of the window."""
    left: Floats
    """(A, 3) measured less predicted, in standard deviations."""

    def take(self, rows: Any) -> "Residuals":
        """Only some of the residuals."""
        return Residuals._make(field[rows] for field in self)


def unique_forms(forms: Integers) -> tuple[Integers, Integers]:
    """Distinct forms (U, 5), and which of them each (N, 5) is."""
    base = int(forms.max(initial=0)) + 3
    code = (forms + 1) @ base ** np.arange(forms.shape[1])[::-1]
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return forms[first], place
