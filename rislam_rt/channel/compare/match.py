"""Matching by identity: kind, landmark and wall names on either leg; delays and columns' order play no part."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.compare.certificate import SHORTEST_SEGMENT, Certifier, Identity
from rislam_rt.channel.compare.report import OneSided, PathReport
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import expect
from rislam_rt.geometry.angles import angle_between
from rislam_rt.model import Paths, Scene, Trajectory


class Columns(NamedTuple):
    """For every identity that either side knows: its column on each side, -1 where it is unknown there."""

    identity: list[Identity]
    traced: Integers
    analytic: Integers


def compare_paths(
    traced: Paths,
    analytic: Paths,
    scene: Scene,
    trajectory: Trajectory,
    *,
    shortest_segment: float = SHORTEST_SEGMENT,
) -> PathReport:
    """Compare two path sets of one scene and trajectory, cycle by cycle and identity by identity.

    Gains are compared as they are: give both sides the same code. Every path that one side lacks is looked up in the
    geometry (`certificate.py`); what has no proof there counts as unexplained. `shortest_segment` [m] is the tracer's
    limit: below it, and only for paths that the tracer lacks, a segment's length is a proof.
    """
    for name, value, kind in (
        ("traced", traced, Paths),
        ("analytic", analytic, Paths),
        ("scene", scene, Scene),
        ("trajectory", trajectory, Trajectory),
    ):
        expect(name, value, kind)
    columns = _align(traced, analytic)
    in_traced, in_analytic = _valid(traced, columns.traced), _valid(analytic, columns.analytic)
    depth = min(traced.tx_walls.shape[1], analytic.tx_walls.shape[1])
    certifier = Certifier.of(scene, trajectory, depth, shortest_segment)
    one_sided = [
        _certify(certifier, columns.identity[path], int(cycle), bool(in_traced[cycle, path]))
        for cycle, path in np.argwhere(in_traced != in_analytic)
    ]
    cycle, path = np.nonzero(in_traced & in_analytic)
    return _report(traced, analytic, (cycle, columns.traced[path]), (cycle, columns.analytic[path]), one_sided)


def _align(traced: Paths, analytic: Paths) -> Columns:
    """The union of both sides' identities."""
    sides = [{named_identity(paths, p): p for p in range(paths.num_paths)} for paths in (traced, analytic)]
    identity = sorted(sides[0].keys() | sides[1].keys())
    here = [np.array([side.get(i, -1) for i in identity], dtype=np.int64) for side in sides]
    return Columns(identity, here[0], here[1])


def named_identity(paths: Paths, path: int) -> Identity:
    """Identity of a column in names, so that two numberings of walls can meet."""
    kind, landmark, tx, rx = paths.identity(path)
    walls = paths.walls
    name = paths.landmarks[landmark] if landmark >= 0 else ""
    return kind, name, tuple(walls[w] for w in tx), tuple(walls[w] for w in rx)


def _valid(paths: Paths, column: Integers) -> Booleans:
    """(K, I) validity of the aligned identities."""
    valid = np.zeros((paths.num_cycles, len(column)), dtype=np.bool_)
    valid[:, column >= 0] = paths.valid[:, column[column >= 0]]
    return valid


def _certify(certifier: Certifier, identity: Identity, cycle: int, is_traced: bool) -> OneSided:
    """The record of one one-sided path."""
    side = "traced" if is_traced else "analytic"
    proof = certifier.explain(identity, cycle, side)
    return OneSided(cycle, certifier.label(identity), side, proof.reason, proof.text, proof.size)


def _report(
    traced: Paths,
    analytic: Paths,
    at_traced: tuple[Integers, Integers],
    at_analytic: tuple[Integers, Integers],
    one_sided: list[OneSided],
) -> PathReport:
    """Errors of the matched paths."""
    gain_t, gain_a = traced.gain[at_traced], analytic.gain[at_analytic]
    return PathReport(
        cycles=traced.num_cycles,
        kind=analytic.kind[at_analytic[1]],
        length_error=SPEED_OF_LIGHT * np.abs(traced.tau[at_traced] - analytic.tau[at_analytic]),
        gain_error_db=_level_difference(np.abs(gain_t), np.abs(gain_a)),
        phase_error=np.abs(np.angle(gain_t * np.conj(gain_a))),
        aod_error=angle_between(traced.departure[at_traced], analytic.departure[at_analytic]),
        aoa_error=angle_between(traced.arrival[at_traced], analytic.arrival[at_analytic]),
        one_sided=tuple(one_sided),
    )


def _level_difference(a: Floats, b: Floats) -> Floats:
    """|20 lg(a / b)| [dB], 0 where both are nothing (a panel seen edge-on, a horizontal polarisation)."""
    floor = np.finfo(np.float64).tiny
    return np.abs(20.0 * np.log10(np.maximum(a, floor) / np.maximum(b, floor)))
