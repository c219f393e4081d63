"""Matching of the paths of two channels by identity: kind, landmark and wall names on either leg, never by delay."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.compare.comparison_report import OneSidedPath, PathReport
from rislam_rt.channel.compare.error_limits import RoomPrecision, coherent_scale, with_perfect_mirrors
from rislam_rt.channel.compare.unmatched_paths import SHORTEST_SEGMENT, DifferenceExplainer, Identity
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.antennas import peak_amplitude
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import expect
from rislam_rt.geometry.angles import angle_between
from rislam_rt.model import Antennas, Paths, RadioConfig, Scene, Trajectory

_RADIO = RadioConfig()


def compare_paths(
    traced: Paths, analytic: Paths, scene: Scene, trajectory: Trajectory, *, radio: RadioConfig = _RADIO,
    shortest_segment: float = SHORTEST_SEGMENT,
) -> PathReport:  # fmt: skip
    """Compare two path sets of one scene and trajectory, cycle by cycle and identity by identity.

    Gains are compared as they are: give both sides the same code. Every path that one side lacks is looked up in the
    geometry (`unmatched_paths.py`); what has no proof there counts as unexplained. Errors of those that both have are
    judged by limits that follow from precision and geometry (`error_limits.py`): float32 where `traced.source` says
    that the numbers are the tracer's own.

    Parameters
    ----------
    radio
        That of both channels.
    shortest_segment
        [m] the tracer's limit: below it, and only for paths that the tracer lacks, a segment's length is a proof.
    """
    expect("traced", traced, Paths)
    expect("analytic", analytic, Paths)
    expect("scene", scene, Scene)
    expect("trajectory", trajectory, Trajectory)
    places = [{named_identity(paths, p): p for p in range(paths.num_paths)} for paths in (traced, analytic)]
    identities = sorted(places[0].keys() | places[1].keys())
    traced_column, analytic_column = (
        np.array([place.get(i, -1) for i in identities], dtype=np.int64) for place in places
    )
    in_traced, in_analytic = _valid(traced, traced_column), _valid(analytic, analytic_column)
    depth = min(traced.tx_walls.shape[1], analytic.tx_walls.shape[1])
    certifier = DifferenceExplainer.of(scene, trajectory, depth, shortest_segment)
    one_sided = []
    for cycle, path in np.argwhere(in_traced != in_analytic):
        identity, side = identities[path], "traced" if in_traced[cycle, path] else "analytic"
        proof = certifier.explain(identity, int(cycle), side)
        one_sided.append(OneSidedPath(int(cycle), certifier.label(identity), side, *proof))
    cycle, path = np.nonzero(in_traced & in_analytic)
    precision = RoomPrecision.of(
        scene, radio, single=traced.source.startswith("traced") and "refined" not in traced.source
    )
    at_traced, at_analytic = (cycle, traced_column[path]), (cycle, analytic_column[path])
    scale = _scale(analytic, identities, (*at_analytic, path), trajectory, precision)
    gain_t, gain_a, least = traced.gain[at_traced], analytic.gain[at_analytic], np.finfo(np.float64).tiny
    level_ratio = np.maximum(np.abs(gain_t), least) / np.maximum(np.abs(gain_a), least)  # 1 where both are 0
    return PathReport(
        cycles=traced.num_cycles,
        labels=tuple(certifier.label(identity) for identity in identities),
        path=path,
        cycle=cycle,
        kind=analytic.kind[at_analytic[1]],
        length_error=SPEED_OF_LIGHT * np.abs(traced.tau[at_traced] - analytic.tau[at_analytic]),
        gain_error_db=np.abs(20.0 * np.log10(level_ratio)),
        gain_error=np.abs(np.abs(gain_t) - np.abs(gain_a)) / np.maximum(scale, least),
        phase_error=np.abs(np.angle(gain_t * np.conj(gain_a))),
        aod_error=angle_between(traced.departure[at_traced], analytic.departure[at_analytic]),
        aoa_error=angle_between(traced.arrival[at_traced], analytic.arrival[at_analytic]),
        limits=precision.limits(analytic, *at_analytic, trajectory, scale),
        one_sided=tuple(one_sided),
        searched={"traced": traced.source, "analytic": analytic.source},
    )


def _scale(
    analytic: Paths, identity: list[Identity], matched: tuple[Integers, Integers, Integers], trajectory: Trajectory,
    precision: RoomPrecision,
) -> Floats:  # fmt: skip
    """Coherent scale (M,) of the gains of matched paths, given by cycle, analytic column and identity."""
    cycle, column, path = matched
    mirrors, antennas = with_perfect_mirrors(precision.scene), precision.radio.antennas
    if (mirrors is None and antennas.plain) or len(path) == 0:
        return coherent_scale(analytic, cycle, column, trajectory, precision)
    radio = replace(precision.radio, antennas=Antennas())
    unit = ImageSourceChannel(mirrors or precision.scene, radio, analytic.tx_walls.shape[1]).paths(trajectory)
    place = {named_identity(unit, p): p for p in range(unit.num_paths)}
    columns = np.array([place.get(i, -1) for i in identity], dtype=np.int64)[path]
    return peak_amplitude(antennas) * coherent_scale(unit, cycle, columns, trajectory, precision)


def named_identity(paths: Paths, path: int) -> Identity:
    """Identity of a path with landmark and walls by name, so that paths of two channels match."""
    kind, landmark, tx, rx = paths.identity(path)
    walls = paths.walls
    name = paths.landmarks[landmark] if landmark >= 0 else ""
    return kind, name, tuple(walls[w] for w in tx), tuple(walls[w] for w in rx)


def _valid(paths: Paths, column: Integers) -> Booleans:
    """Validity (K, I) of path identities in one channel, given by their columns (I,), -1 for none."""
    valid = np.zeros((paths.num_cycles, len(column)), dtype=np.bool_)
    valid[:, column >= 0] = paths.valid[:, column[column >= 0]]
    return valid
