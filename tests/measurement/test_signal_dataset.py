"""A data set of signals says the same after a trip through a file, and stands on its own."""

import numpy as np
import pytest

from rislam_rt.errors import StoreError
from rislam_rt.information import measurement_std
from rislam_rt.measurement import ReceiverConfig, load_signals, signals_dataset
from rislam_rt.model import PathKind, RadioConfig, Trajectory

RADIO = RadioConfig()


def trajectory():
    return Trajectory(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1))


@pytest.mark.parametrize("alternation", [False, True])
def test_round_trip(tmp_path, make_paths, make_gain, alternation):
    paths = make_paths(
        [
            (PathKind.VT, 5.0, (0.1, 0.0, 1.0), make_gain(50.0, RADIO, 0.2)),
            (PathKind.RIS, 7.0, (0.3, 0.2, 0.9), make_gain(30.0, RADIO, 1.2)),
        ]
    )
    config = ReceiverConfig(estimator="waveform", alternation=alternation, false_alarm_rate=1e-3)
    data = signals_dataset(paths, trajectory(), RADIO, config, rng=np.random.default_rng(1))
    data.to_netcdf(tmp_path / "signals.nc", engine="h5netcdf")
    loaded = load_signals(tmp_path / "signals.nc")
    assert loaded["samples"].shape == (1, 1 + alternation, 16, 128)
    assert loaded["found_path"].values.tolist() == [[0, 1]]
    np.testing.assert_allclose(loaded["found_from_panel"].values, [[0, int(alternation)]], atol=1e-3)
    # samples are stored in single precision; at 30 dB the gain is within a few percent of the truth
    np.testing.assert_allclose(loaded["found_gain"].values[0, 1], paths.gain[0, 1], rtol=0.2)
    bound = measurement_std(np.array([1e5, 1e3]), RADIO)  # each path alone in its cell, its amplitude to a tenth
    np.testing.assert_allclose(loaded["found_tau_std"].values[0], bound.tau, rtol=0.1)
    np.testing.assert_allclose(loaded["found_cosines_std"].values[0], bound.cosines, rtol=0.1)
    spectrum = loaded["samples"].values[0, 0]
    matched = np.exp(2j * np.pi * loaded["frequency"].values * paths.tau[0, 0])
    antennas = np.exp(-2j * np.pi / RADIO.wavelength * loaded["antenna_position"].values @ paths.arrival[0, 0])
    estimate = antennas @ spectrum @ matched / (16 * np.sqrt(128 * loaded.attrs["radio_energy"]))
    np.testing.assert_allclose(estimate, paths.gain[0, 0], rtol=0.2)


def test_missing_and_damaged_files_are_one_line(tmp_path):
    with pytest.raises(StoreError, match="no such file"):
        load_signals(tmp_path / "none.nc")
    (tmp_path / "bad.nc").write_bytes(b"not a data set")
    with pytest.raises(StoreError, match="not a readable"):
        load_signals(tmp_path / "bad.nc")
