"""How far a track's components are expected to err: neighbours in their cell, by its SNR and by what it has shown."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.measurement.components import merge, path_std
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.detection_threshold import build_sensor
from rislam_rt.measurement.received_paths import Received
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL
from rislam_rt.slam.window.hypotheses.track_summary import expected_scatter, summarise_tracks
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.smoother import window_gaussian

RADIO = RadioConfig()
SENSOR = build_sensor(RADIO, ReceiverConfig())


def pull(amplitude: float, snr: float, rng: np.random.Generator) -> float:
    """Mean square pull, in reported deviations, of a path by one in its cell of so much of its amplitude."""
    gain = np.sqrt(snr / float(RADIO.integrated_snr(1.0))) * np.array(
        [1.0, amplitude * np.exp(2j * np.pi * rng.random())]
    )
    apart = rng.uniform(-1.0, 1.0, 3)  # cells
    array = RADIO.array
    cosines = apart[1:] / (np.array([array.rows, array.cols]) * array.spacing)
    ray = np.zeros((2, 3))
    ray[1, :2] = cosines
    tau = np.array([50e-9, 50e-9 + apart[0] / RADIO.bandwidth])
    none = np.zeros(2)
    received = Received(np.arange(2), tau, ray, gain, np.full(2, -1), none, none)
    found = merge(received, SENSOR)
    assert len(found.tau) == 1
    delay, across = path_std(RADIO.integrated_snr(found.gain), RADIO)
    off = np.array([found.tau[0] - tau[0], *(found.cosines[0] - ray[0, :2])])
    return float(np.mean((off / np.array([delay[0], *across[0]])) ** 2))


@pytest.mark.parametrize("snr", [1e2, pytest.param(1e4, marks=pytest.mark.slow)])
def test_a_neighbour_moves_a_component_by_its_own_snr(snr: float) -> None:
    rng, amplitude = np.random.default_rng(3), 0.1
    squares = np.array([pull(amplitude, snr, rng) for _ in range(4000)])
    # a gap evenly within a cell has a third of its square in the mean, a random phase a half, a deviation is 0.39 cells
    # over the root of the SNR: 1.10; half of the phases push away from the neighbour, and the component stays between
    # the two: 0.55. Across, the aperture of 8 elements is 1 - 1/64 of a line's; the amplitude adds its square.
    error = 4.0 * squares.std() / np.sqrt(len(squares))
    assert abs(squares.mean() / (amplitude**2 * snr) - 0.55) < error / (amplitude**2 * snr) + 1.0 / 64.0 + amplitude**2


def test_what_is_expected_is_right_on_the_average_whatever_was_shown() -> None:
    rng, count, free = np.random.default_rng(4), 100_000, 4
    for snr in (20.0, 1e4):
        pulled = rng.random(count) < CONSTANTS.company
        square = np.where(pulled, np.exp(rng.random(count) * np.log1p(snr)), 1.0)
        shown = square * rng.chisquare(free, count) / free
        found = expected_scatter(np.tile(shown[:, None], 3), np.full((count, 1), float(free)), np.full((count, 1), snr))
        off = np.log(square) - np.log(found[:, 0])
        for low, high in ((0.0, 0.7), (0.7, 1.5), (1.5, 4.0), (4.0, np.inf)):
            among = off[(shown >= low) & (shown < high)]
            # the grid is coarse: its steps are a twelfth of the whole
            assert abs(among.mean()) < 4.0 * among.std() / np.sqrt(len(among)) + np.log1p(snr) / 24.0


def history(log_amplitude_std: float, side: int = OTHER, number: int = 6) -> Log:
    """A track of 6 components that lie where a straight line has them."""
    time, none = np.arange(number), np.zeros(number)
    seen = np.column_stack([4.0 + 0.01 * time, 0.2 + 0.001 * time, 0.1 + 0.0 * time])
    wide = np.zeros((number, 3))
    return Log(
        time, seen, np.full((number, 3), 0.01), none, np.full(number, log_amplitude_std), np.full(number, side),
        np.zeros(number, dtype=np.int64), np.zeros((number, 2, 5), dtype=np.int64), none, wide, wide,
    )  # fmt: skip


def scatter_expected(log: Log) -> float:
    """Mean square that the summary holds the track's components to have."""
    number = len(log.cycle)
    window = window_gaussian.begin(np.zeros(3), np.array([0.1, 0.0, 0.0]), np.array([1e-3] * 6 + [0.0]))
    for _ in range(number - 1):
        window = window_gaussian.extend(window, 0.1, np.full(3, 25.0))
    window = window_gaussian.solve(window)
    state = SimpleNamespace(
        log=log, window=window, heading=np.zeros(number), cycle=number - 1,
        scene=SimpleNamespace(body=Body(), radio=RADIO, use_vt=False),
    )  # fmt: skip
    found, _ = summarise_tracks(state, [np.arange(number)])
    return float(np.mean(found.scatter**2))


def test_what_keeps_to_a_line_is_taken_at_its_word_the_sooner_the_fainter_it_is() -> None:
    faint, loud = (
        [scatter_expected(history(float(np.sqrt(0.5 / snr)), number=number)) for number in (6, 40)]
        for snr in (10.0, 1e5)
    )
    # at the detection threshold a neighbour no louder than the track moves it by three deviations at most
    assert 1.0 < faint[1] < faint[0] < 1.3
    assert 1.0 < loud[1] < 1.3 < loud[0] < 3.0
    # and what only the panel's paths are in has no neighbours
    assert scatter_expected(history(float(np.sqrt(0.5 / 1e5)), PANEL)) == pytest.approx(1.0)


def test_of_what_has_shown_nothing_a_loud_track_may_be_pulled_farther() -> None:
    nothing = np.zeros((1, 1))
    faint, loud = (expected_scatter(np.ones((1, 3)), nothing, np.full((1, 1), snr))[0, 0] for snr in (10.0, 1e5))
    # of `company`, half of the logarithm of one and the track's own SNR
    assert faint == pytest.approx(11.0 ** (0.5 * CONSTANTS.company))
    assert loud == pytest.approx(1e5 ** (0.5 * CONSTANTS.company), rel=1e-4)


def test_a_loud_track_that_is_seen_to_be_pulled_is_weighed_so() -> None:
    snr, shown = np.full((1, 1), 1e5), np.full((1, 3), 300.0)
    found = expected_scatter(shown, np.full((1, 1), 9.0), snr)
    assert ((found > 100.0) & (found < 500.0)).all()
    # nothing in its cell is louder than itself
    assert (expected_scatter(shown, np.full((1, 1), 9.0), np.full((1, 1), 10.0)) <= 11.0).all()
