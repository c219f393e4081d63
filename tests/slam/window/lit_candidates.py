"""A track that codes of the panel have lit, with the room and the codes around it, for the tests of RIS candidates."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design import exact_code
from rislam_rt.model import RadioConfig, RisCode, RisSpec, SensorModel
from rislam_rt.ris import leg_response
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.observations import PANEL
from rislam_rt.slam.predicted_returns import Poses
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.tracks import WindowTracks, no_tracks

HERE = np.array([2.0, 2.0, 1.0])
CYCLE = 40
SENSOR = SensorModel(RadioConfig(), false_alarms=2.0)
SHEET = RisSpec(2, 2, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
ACROSS = [np.array([[0, 0], [0, 0]]), np.array([[0, 2], [0, 2]]), np.array([[0, 0], [2, 2]])]
CODES = tuple(RisCode(ACROSS[index], 4) for index in (0, 1, 2, 2, 2))  # none lights what another one does


def poses() -> Poses:
    return Poses(HERE, HERE, np.array(0.0))


def tracks_at(places: Floats, log_odds: list[float], hits: int = 3, log_real: float = 30.0) -> WindowTracks:
    """Tracks of the last cycle that come from places (T, 3), with log odds of being a panel and of being real."""
    count, empty, span = len(places), no_tracks(1), places - HERE
    length = 2.0 * np.linalg.norm(span, axis=1)
    mean = np.zeros((count, 3, 2))
    mean[:, 0, 0], mean[:, 1:, 0] = length, span[:, :2] / np.linalg.norm(span, axis=1)[:, None]
    whole = np.full(count, CYCLE)
    fields = {name: np.zeros((count, *getattr(empty, name).shape[1:])) for name in ("log_grid", "hidden", "rises")}
    return empty._replace(
        ident=np.arange(count), mean=mean, covariance=np.zeros((count, 3, 2, 2)), log_amplitude=np.zeros(count),
        side=whole * 0 + PANEL, born=whole - hits, last=whole, earlier=whole,
        earlier_log_amplitude=np.zeros(count), hits=whole * 0 + hits, looked=whole * 0,
        log_ris=np.array(log_odds)[:, None], log_real=np.full(count, log_real),
        log_direct=np.full((count, 1), 30.0), log_leak=np.full((count, 1), -np.inf), next_ident=count, **fields,
    )  # fmt: skip


SIX = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
PLACE = HERE + np.array([1.0, 0.7, 2.0])


def aimed_scene() -> tuple[KnownEnvironment, RisCode, float]:
    """What is told of a panel of 6 x 6, the code aimed at `PLACE`, and the amplitude under it: an SNR of 40."""
    leg = leg_response(SIX, PLACE[None], HERE, np.ones(1, dtype=np.complex128), SENSOR.radio.wavelength)
    index, _ = exact_code((leg**2).reshape(1, -1), SIX.levels)
    aimed = RisCode(index.reshape(6, 6), SIX.levels)
    gain = np.abs(panel_path_gain(SIX, aimed, PLACE[None], HERE, HERE, np.ones(1), SENSOR.radio))[0]
    radio = replace(SENSOR.radio, energy=SENSOR.radio.energy * 40.0 / float(SENSOR.radio.integrated_snr(gain)))
    return KnownEnvironment(None, radio, SensorModel(radio, false_alarms=2.0), SIX, 2, True), aimed, float(gain)


def at_place(gain: float) -> WindowTracks:
    """Track at `PLACE` that was heard with that amplitude in cycle 0, and of which no code has told anything."""
    first = np.zeros(1, dtype=np.int64)
    return tracks_at(PLACE[None], [0.0])._replace(
        log_amplitude=np.log([gain]), earlier_log_amplitude=np.log([gain]), log_grid=unknown(1).log_grid,
        log_direct=np.zeros((1, 1)), hidden=np.zeros((1, 2)), last=first, earlier=first,
        born=first, hits=first + 1,
    )  # fmt: skip
