"""Lengths are counted from the direct path where the clocks of Tx and Rx are apart, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.slam.observations import ASIDE, clock_offset, free_space, is_los, observations_of

RADIO, BODY = RadioConfig(), Body()
BASELINE = float(np.linalg.norm(BODY.tx_offset - BODY.rx_offset))
TOWARDS = (BODY.tx_offset - BODY.rx_offset)[:2] / BASELINE
FIELDS = "tau", "cosines", "amplitude", "tau_std", "cosines_std", "amplitude_std"
STD = 1e-5
"""[m] of the direct path's length: 46 dB and more above the panel's."""


def heard(
    late: float, lengths: tuple[float, ...] = (BASELINE, 2.0, 5.3), loss: float = 1.0, cosine: Floats | None = None
) -> Measurement:
    """Free-space components of some lengths [m] that come in later by `late` [m], the first from where the Tx is, or
    from a `cosine` (2,), of amplitude `loss` times free space's, and the others over walls."""
    length, count = np.array(lengths), len(lengths)
    ratio = np.r_[loss, 0.85, 0.85][:count]
    cosines = np.zeros((count, 2))
    cosines[:1] = TOWARDS if cosine is None else cosine
    return Measurement(
        (length + late) / SPEED_OF_LIGHT, cosines, ratio * np.exp(free_space(RADIO)) / length,
        np.full(count, STD / SPEED_OF_LIGHT), np.full((count, 2), 0.01), np.full(count, 1e-9),
    )  # fmt: skip


@pytest.mark.parametrize("late", [-4.0, -0.03, 0.001, 1.8, 40.0])
def test_lengths_are_counted_from_the_direct_path(late: float) -> None:
    found, plain = (observations_of(heard(each), RADIO, BODY) for each in (late, 0.0))
    np.testing.assert_allclose(found.seen, plain.seen, atol=1e-12)  # rounding of delays in float64
    np.testing.assert_allclose(found.ratio, plain.ratio, rtol=1e-9)  # that rounding over 0.1 m
    assert is_los(found, BODY).tolist() == [True, False, False]


def test_one_clock_stays_exactly_one() -> None:
    """Noise moves nothing: the direct path errs in its deviation, and the odds that it errs by so much decide."""
    drawn = STD * np.random.default_rng(5).standard_normal(200)
    assert not any(clock_offset(heard(each), RADIO, BODY) for each in drawn)
    # rare (1 in 50) over 30 m, against a Gaussian of 0.01 mm: beyond sqrt(2 ln(50 * 30 m / (sqrt(2 pi) STD))) = 6.0
    assert clock_offset(heard(5.9 * STD), RADIO, BODY) == 0.0
    assert clock_offset(heard(6.1 * STD), RADIO, BODY) == pytest.approx(6.1 * STD, rel=1e-6)


def test_nothing_but_the_direct_path_is_taken_for_it() -> None:
    """Without it, or where it is cancelled, the first wall's return says nothing about clocks, however near."""
    assert clock_offset(heard(1.0, (2.0, 5.3)), RADIO, BODY) == 0.0
    assert clock_offset(heard(1.0, (2.02 * BASELINE, 5.3)), RADIO, BODY) == 0.0
    assert clock_offset(heard(1.0, (1.98 * BASELINE, 5.3)), RADIO, BODY) != 0.0
    assert clock_offset(heard(1.0, loss=0.49), RADIO, BODY) == 0.0
    assert clock_offset(heard(0.05, cosine=np.array([0.0, 0.0])), RADIO, BODY) == 0.0
    assert clock_offset(heard(0.0, ()), RADIO, BODY) == 0.0


@pytest.mark.parametrize("off", [0.9 * ASIDE, -0.9 * ASIDE])
def test_a_tilted_body_still_knows_where_its_tx_is(off: float) -> None:
    assert clock_offset(heard(1.0, cosine=TOWARDS + np.array([off, 0.0])), RADIO, BODY) == pytest.approx(1.0)


def test_the_ends_of_the_arrays_line_are_alike() -> None:
    """A Tx along body y is heard from y = 1 or -1."""
    body = Body(np.array([0.0, 0.05, 0.0]), np.array([0.0, -0.05, 0.0]))
    for end in (1.0, -1.0):
        measured = heard(2.0, (0.1, 2.0, 5.3), cosine=np.array([0.0, end]))
        assert clock_offset(measured, RADIO, body) == pytest.approx(2.0)


def test_of_several_direct_paths_none_is_one() -> None:
    """A saturated receiver makes fragments of it."""
    one = heard(-0.05)
    twice = replace(
        one, **{name: np.concatenate([getattr(one, name)[:1], getattr(one, name)]) for name in FIELDS},
    )  # fmt: skip
    assert clock_offset(one, RADIO, BODY) == pytest.approx(-0.05)
    assert clock_offset(twice, RADIO, BODY) == 0.0
