"""Log of the window's measurements, and the paths that each was associated with."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN


class ArrayEnds(NamedTuple):
    """Components of T tracks or paths, those that the array hears alike from two directions once for each: E ends, N
    components in all."""

    row: Integers
    """(N,) row of each component in the log."""
    which: Integers
    """(N,) end that it belongs to."""
    cosines: Floats
    """(N, 2) direction cosines at that end."""
    std: Floats
    """(N, 2) their standard deviations there."""
    owner: Integers
    """(E,) track or path of each end: 0 to T - 1, and the other ends of those that have two."""


class Log(NamedTuple):
    """Components measured in the window's cycles, N of them in the order of time, and the path that each was associated
    with."""

    cycle: Integers
    """(N,) number of the cycle."""
    seen: Floats
    """(N, 3) measured length [m] and two direction cosines."""
    std: Floats
    """(N, 3) their reported standard deviations."""
    log_amplitude: Floats
    """(N,) measured log amplitude."""
    log_amplitude_std: Floats
    """(N,) its reported standard deviation."""
    side: Integers
    """(N,) panel that the component ran over, `OTHER` or `UNTOLD` (see `slam.observations`)."""
    track: Integers
    """(N,) ident of the track that it belongs to, -1 for none."""
    form: Integers
    """(N, 2, 5) forms, by feature idents, of the path that it was associated with and of an unresolved partner; the
    base is `UNKNOWN` where there is none."""
    share: Floats
    """(N,) weight of the partner in the predicted place: 0 is the path alone, 1 the partner."""
    extra: Floats
    """(N, 3) variance of length and cosines beyond the reported one..."""
    shared: Floats
    """(N, 3) ...and its part by other paths of the map in the component's cell: the rest is scatter by paths that the
    map lacks."""

    def take(self, rows: Any) -> "Log":
        """Measurement log with only some of the components."""
        return Log._make(field[rows] for field in self)

    def explain(
        self, rows: Integers, forms: Integers, share: Floats | float, shared: Floats | float, scatter: Floats
    ) -> "Log":
        """Measurement log with components `rows` (A,) associated with forms (A, 2, 5) of idents, with partners' shares
        (A,) and extra variances (A, 3): by paths of the map in their cells, and by scatter."""
        form, shares, variance, known = self.form.copy(), self.share.copy(), self.extra.copy(), self.shared.copy()
        form[rows], shares[rows], variance[rows], known[rows] = forms, share, shared + scatter, shared
        return self._replace(form=form, share=shares, extra=variance, shared=known)

    def momentary(self, rows: Integers) -> Floats:
        """Variance (A, 3) of each of the measurements `rows` (A,) taken alone: scatter counts `memory` times in
        `extra`, as its pull keeps its sign for as many cycles."""
        std, extra, shared = self.std[rows], self.extra[rows], self.shared[rows]
        return np.asarray(std**2 + shared + (extra - shared) / CONSTANTS.memory)

    def scatter(self, rows: Integers) -> Floats:
        """Mean squares (A,) of the residuals of wall returns `rows` (A,), in reported deviations, by which they are
        weighed: what `extra` holds of scatter."""
        pulled = self.extra[rows, 0] - self.shared[rows, 0]
        return np.asarray(1.0 + pulled / (CONSTANTS.memory * self.std[rows, 0] ** 2))

    def sharper(self, rows: Integers) -> Floats:
        """Factor (A, 3) by which residuals of the components `rows` (A,) grow where they are measured in deviations of
        their own cycle (`momentary`), not in those by which they are weighed in the window."""
        whole = self.std[rows] ** 2 + self.extra[rows]
        return np.asarray(np.sqrt(whole / self.momentary(rows)))

    def mirrored(self, rows: Integers, spacing: float) -> Booleans:
        """Whether the cosines (A, 2) of the components `rows` (A,) may as well be one period of the array off, whose
        antennas stand `spacing` wavelengths apart.

        Near the array's own line the receiver takes now the one and now the other, and counts the period into the
        variance by the other's probability. The other has to lie in the sky, within what the other axis deviates by.
        """
        cosine, std = np.abs(self.seen[rows, 1:]), self.std[rows, 1:]
        inside = np.hypot(1.0 / spacing - cosine, cosine[:, ::-1]) < 1.0 + CONSTANTS.fit * std[:, ::-1]
        return np.asarray(inside & (std**2 > (1.0 - CONSTANTS.born) / spacing**2))

    def nearest(self, rows: Integers, left: Floats, spacing: float) -> Floats:
        """Residuals (A, 2) of the cosines of components `rows` (A,), those that may as well be one period of the array
        off (`mirrored`) modulo that.

        A level path lies on the rim in every cycle. On which side of it noise puts the estimate is no news of where it
        arrives from.
        """
        turns = np.where(self.mirrored(rows, spacing), np.round(left * spacing), 0.0)
        return np.asarray(left - turns / spacing)

    def mostly_mirrored(self, rows: Integers, which: Integers, count: int, spacing: float) -> Booleans:
        """Whether most of the components `rows` (A,) of each of T = `count` tracks or paths `which` (A,) are `mirrored`
        along either axis of the array (T, 2)."""
        excess = np.zeros((count, 2))
        np.add.at(excess, which, self.mirrored(rows, spacing) - 0.5)
        return excess > 0.0

    def histories(self, first: int) -> tuple[Integers, Integers, Integers]:
        """Rows (A,) of the components from cycle `first` on that are of a track or were associated with a path, which
        track or path (A,) each is of, and what names each of these for life (T, 6)."""
        known = self.explained
        rows = ((known | (self.track >= 0)) & (self.cycle >= first)).nonzero()[0]
        forms = np.where(known[rows, None], self.form[rows, 0], UNKNOWN)
        every = np.concatenate([forms, np.where(known[rows], -1, self.track[rows])[:, None]], axis=1)
        names, which = unique_forms(every)
        return rows, which, names

    def both_ends(self, rows: Integers, which: Integers, spacing: float) -> "ArrayEnds":
        """Components `rows` (A,) of tracks or paths `which` (A,), with those of which most are `mirrored` once for
        either end, behind all others.

        The cosine along the other axis tells by how much one at the array's end errs, of whose sign nothing is known.
        """
        cosines, std, count = self.seen[rows, 1:], self.std[rows, 1:], int(which.max(initial=-1)) + 1
        twofold = self.mostly_mirrored(rows, which, count, spacing)
        both = twofold[which]
        if not both.any():
            return ArrayEnds(rows, which, cosines, std, np.arange(count))
        rim, period = np.sqrt(np.maximum(1.0 - cosines[:, ::-1] ** 2, 0.0)), 1.0 / spacing
        end = np.where(both, np.minimum(cosines + period * (cosines < 0.0), rim), cosines)
        other = np.where(both, np.maximum(end - period, -rim), cosines)
        std = np.where(both, np.minimum(std, std[:, ::-1]), std)
        twice, owner = both.any(axis=1), np.flatnonzero(twofold.any(axis=1))
        again = count + np.searchsorted(owner, which[twice])
        return ArrayEnds(
            np.append(rows, rows[twice]), np.append(which, again), np.concatenate([end, other[twice]]),
            np.concatenate([std, std[twice]]), np.append(np.arange(count), owner),
        )  # fmt: skip

    def at_ends(self, ends: "ArrayEnds") -> "Log":
        """Measurement log of the components of `ends`, each with the direction that it has there."""
        log = self.take(ends.row)
        seen, std = log.seen.copy(), log.std.copy()
        seen[:, 1:], std[:, 1:] = ends.cosines, ends.std
        return log._replace(seen=seen, std=std)

    @property
    def explained(self) -> Booleans:
        """Whether each component (N,) was associated with a path of the map."""
        return np.asarray(self.form[:, 0, 0] != UNKNOWN)


def empty_log() -> Log:
    """Measurement log without measurements."""
    none, count = np.zeros(0), np.zeros(0, dtype=np.int64)
    wide = np.zeros((0, 3))
    return Log(count, wide, wide, none, none, count, count, np.zeros((0, 2, 5), dtype=np.int64), none, wide, wide)


def append(log: Log, observed: Observations, cycle: int, first: int) -> Log:
    """Measurement log with a cycle's components appended, not yet associated, and without those of cycles before
    `first`."""
    count, old = len(observed.seen), log.take(slice(np.searchsorted(log.cycle, first), None))
    fresh = Log(
        np.full(count, cycle), observed.seen, observed.std, observed.log_amplitude, observed.log_amplitude_std,
        observed.sides,
        np.full(count, -1), np.full((count, 2, 5), UNKNOWN), np.zeros(count), np.zeros((count, 3)),
        np.zeros((count, 3)),
    )  # fmt: skip
    return Log(*(np.concatenate(pair) for pair in zip(old, fresh, strict=True)))


class Residuals(NamedTuple):
    """Residuals of A components of the log that were associated with paths of the map."""

    row: Integers
    """(A,) row of each in the log."""
    slot: Integers
    """(A,) index of its pose in the window."""
    left: Floats
    """(A, 3) measured less predicted length and cosines, in standard deviations."""
    slopes: Floats
    """(A, 3, 4 + 3F) of the predictions by pose and features, in standard deviations."""
    square: Floats
    """(A,) expected mean squares of the errors, in reported deviations (see `squares`); 0 before a solution."""

    def take(self, rows: Any) -> "Residuals":
        """Residuals of only some of the log's measurements."""
        return Residuals._make(field[rows] for field in self)


def squares(rows: Integers, left: Floats, log: Log, spread: Floats | float, excess: Floats | float = 0.0) -> Floats:
    """Expected mean squares (A,) of the errors of the log's components `rows` (A,), in reported deviations, given
    their residuals `left` (A, 3) and the variance `spread` (A, 3) of what they were compared with, in deviations.

    The estimate has followed the measurement by as much as it was free to, so that a residual is smaller than the
    error is (the E step of expectation maximisation, Dempster et al. 1977). It has not followed manoeuvres that it
    holds for none: a residual is the sum of the error and of these, of variance `excess` (A, 3) in squared deviations.
    """
    std, extra, now = log.std[rows], log.extra[rows], log.momentary(rows)
    own = 1.0 / (1.0 + np.asarray(excess))
    left = own**2 * left**2 + 1.0 - own
    return np.asarray(np.mean(left * (1.0 + extra / std**2) + np.minimum(spread, 1.0) * now / std**2, axis=1))


def unique_forms(forms: Integers) -> tuple[Integers, Integers]:
    """Distinct forms (U, 5) among the forms (N, 5) of the log's measurements, and the index (N,) of each among them."""
    base = int(forms.max(initial=0)) + 3
    code = (forms + 1) @ base ** np.arange(forms.shape[1])[::-1]
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return forms[first], place


def scatter_variance(scatter: Floats, std: Floats) -> Floats:
    """Extra variance (A, 3) beyond the reported one of components on paths whose residuals have the mean square
    `scatter` (A,), in reported deviations."""
    return np.asarray(CONSTANTS.memory * (np.maximum(scatter, 1.0) - 1.0)[:, None] * std**2)


def reweigh_wall_returns(log: Log, left: Residuals, num_poses: int, until: int | None = None) -> Log:
    """Re-estimate the extra variance of all wall returns in the log from the residuals of the same path in earlier and
    later cycles, if they are among the first `until` of the window.

    Points keep theirs, as their panel identity was weighed with it. The prior (`crowd`) counts as one measurement.
    """
    left = left.take(log.form[left.row, 0, 0] == TX)
    if not len(left.row):
        return log
    std = log.std[left.row]
    raw = left.square
    _, which = unique_forms(log.form[left.row, 0])
    total, count = np.zeros((2, num_poses, which.max() + 1))
    np.add.at(total, (left.slot, which), np.minimum(raw, _loudest(log, left.row)))
    np.add.at(count, (left.slot, which), 1.0)
    if until is not None:
        total[until:], count[until:] = 0.0, 0.0
    slots = np.arange(num_poses)
    fade = (1.0 - CONSTANTS.memory / CONSTANTS.window) ** np.abs(slots[:, None] - slots)
    scatter = ((CONSTANTS.crowd + fade @ total) / (1.0 + fade @ count))[left.slot, which]
    extra = log.extra.copy()
    extra[left.row] = log.shared[left.row] + scatter_variance(scatter, std)
    return log._replace(extra=extra)


def _loudest(log: Log, rows: Integers) -> Floats:
    """Largest mean squares (A,) that unresolved neighbours give to errors of the log's components `rows` (A,), in
    reported deviations: those of a neighbour as loud as the component, which its own SNR is worth."""
    return np.asarray(1.0 + 0.5 / np.maximum(log.log_amplitude_std[rows], 1e-6) ** 2)
