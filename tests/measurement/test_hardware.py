"""Real front ends: each fault does to the samples what it says, and calibration takes out what stands still."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.measurement import (
    HardwareConfig,
    ReceiverConfig,
    build_front_end,
    calibrate,
    capture,
    expected_distortion,
    measure,
    receive,
    to_samples,
)
from rislam_rt.measurement.hardware import SentSignal, _clipped, digitise, image_spectrum, scaled_to_fit
from rislam_rt.measurement.received_paths import direct_gain
from rislam_rt.measurement.received_signal import convert, to_tones
from rislam_rt.model import RadioConfig
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
RADIO, RECEIVER = RadioConfig(), ReceiverConfig(estimator="waveform", alternation=False)
SENT = SentSignal(1.0, 0.0)


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def stage():
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", ["channel=image_source", "cycles=30", "depth=1"])
    return prepare_setup(load_scene(ROOT / "scenes" / "paper_room"), spec, rng=rng(1))


def signal(seed=1, power=1e-6):
    parts = rng(seed).standard_normal((2, 16, 128))
    return np.sqrt(power / 2.0) * (parts[0] + 1j * parts[1])


def test_an_ideal_front_end_is_none(stage):
    """Components with a front end that does nothing wrong are those without one, but for rounding."""
    ideal = build_front_end(HardwareConfig(), RADIO, RECEIVER, rng=rng())
    heading = float(stage.scene.agent.heading[3])
    for alternation in (False, True):
        config = ReceiverConfig(estimator="waveform", alternation=alternation)
        given = stage.paths, 3, heading, RADIO, config, None, None
        one, other = (measure(*given, front, rng=rng(5))[0] for front in (None, ideal))
        np.testing.assert_allclose(one.tau, other.tau, rtol=1e-9)
        np.testing.assert_allclose(one.amplitude, other.amplitude, rtol=1e-9)


@pytest.mark.parametrize(
    ("config", "expected"),
    [
        (HardwareConfig(phase_std_deg=2.0), np.radians(2.0) ** 2),
        (HardwareConfig(gain_std_db=0.2), (0.2 * np.log(10.0) / 20.0) ** 2),
        (HardwareConfig(phase_noise_deg=2.0), np.radians(2.0) ** 2),
        (HardwareConfig(iq_image=0.02), 0.02**2),
    ],
    ids=["phase", "gain", "phase noise", "image"],
)
def test_a_fault_has_the_power_that_it_says(config, expected):
    """Power of what is wrong over that of the signal, mean over 60 receivers of 16 chains: five standard errors."""
    shares = []
    for number in range(60):
        front = build_front_end(config, RADIO, RECEIVER, rng=rng(number))
        clean = signal(number)
        heard, level = digitise(clean, SENT, RADIO, RECEIVER, front, rng=rng(1000 + number))
        wrong = np.mean(np.abs(heard - clean) ** 2) - level
        shares.append(wrong / np.mean(np.abs(clean) ** 2))
    assert np.mean(shares) == pytest.approx(expected, rel=5.0 * np.sqrt(2.0 / (60 * 16)))


def test_told_of_its_faults_the_estimator_reckons_with_their_power():
    config = HardwareConfig(phase_std_deg=2.0, gain_std_db=0.2, iq_image=0.02, told=True)
    levels, powers = [], []
    for number in range(60):
        front, clean = build_front_end(config, RADIO, RECEIVER, rng=rng(number)), signal(number)
        heard, level = digitise(clean, SENT, RADIO, RECEIVER, front, rng=rng(1000 + number))
        levels.append(level)
        powers.append(np.mean(np.abs(heard - clean) ** 2))
    assert np.mean(levels) == pytest.approx(np.mean(powers), rel=5.0 * np.sqrt(2.0 / (60 * 16)))


@pytest.mark.parametrize("alternation", [False, True])
def test_the_distortion_to_expect_is_what_the_estimator_is_told_on_average(stage, alternation):
    """From the paths' gains, against the levels that come with the samples; the power of a sum of paths over antennas
    and tones is the sum of their powers but for cross terms, which 30 cycles leave at a few percent."""
    config = HardwareConfig(phase_std_deg=3.0, coupling=0.02, leakage_residue=0.01, told=True)
    receiver = ReceiverConfig(estimator="waveform", alternation=alternation, leakage_cancellation_db=10.0)
    front, paths = build_front_end(config, RADIO, receiver, rng=rng(4)), stage.paths
    direct = np.array([direct_gain(paths, cycle) for cycle in range(30)])
    heard = [receive(paths, cycle, float(stage.scene.agent.heading[cycle]), RADIO, receiver) for cycle in range(30)]
    levels = [
        capture(one, RADIO, receiver, front, leakage, rng=rng(5))[0].noise_psd
        for one, leakage in zip(heard, direct, strict=True)
    ]
    power = np.array([np.sum(np.abs(one.gain) ** 2) for one in heard])
    expected = expected_distortion(config, RADIO, receiver, power, np.abs(direct) ** 2)
    assert np.mean(levels) - RADIO.noise_psd == pytest.approx(expected.mean(), rel=0.05)
    tuned = HardwareConfig(phase_std_deg=3.0, coupling=0.02, leakage_residue=0.01, told=True, calibration_cycles=5)
    assert (expected_distortion(tuned, RADIO, receiver, power, np.abs(direct) ** 2) == 0.0).all()


def test_an_image_lies_mirrored_in_frequency_and_beside_in_time():
    """Mixing the conjugate of the samples in time is mixing mirrored conjugate tones: one by FFT, one by indices."""
    spectrum = signal()
    in_time = to_tones(np.conj(to_samples(spectrum, RADIO)), RADIO)
    np.testing.assert_allclose(in_time, image_spectrum(spectrum), atol=1e-12 * np.abs(spectrum).max() * 128)


def test_what_clipping_cuts_off_a_normal_signal():
    """The closed form against draws: power above the level, within five standard errors of 4e5 samples."""
    value = rng(2).standard_normal(400_000)
    for level in (1.5, 2.5):
        cut = (np.abs(value) - np.minimum(np.abs(value), level)) ** 2
        assert _clipped(level) == pytest.approx(cut.mean(), abs=5.0 * cut.std() / np.sqrt(len(cut)))
    clean = signal(power=1.0)
    clipped, _ = convert(clean, 0, RADIO, 1.5)
    share = np.mean(np.abs(clipped - clean) ** 2) / np.mean(np.abs(clean) ** 2)
    assert share == pytest.approx(_clipped(1.5), rel=0.2)  # of 4096 samples a tenth is clipped


def test_the_residue_is_there_in_every_cycle_and_scales_with_the_leakage():
    front = build_front_end(HardwareConfig(leakage_residue=0.1), RADIO, RECEIVER, rng=rng())
    quiet = RadioConfig(noise_psd=1e-30)
    one, other = (
        digitise(np.zeros((16, 128), complex), SentSignal(1.0, leak), quiet, RECEIVER, front, rng=rng(3))[0]
        for leak in (1.0, 2.0)
    )
    np.testing.assert_allclose(other, 2.0 * one, atol=1e-12)
    assert np.mean(np.abs(one) ** 2) == pytest.approx(0.01, rel=5.0 / np.sqrt(2048))  # 2048 exponential powers


def test_halves_that_turn_against_each_other_are_brought_in_step():
    one = signal()
    np.testing.assert_allclose(scaled_to_fit(one * 1.3 * np.exp(0.4j), one), one, rtol=1e-12)


@pytest.mark.slow
def test_calibration_finds_the_chains_and_what_the_leakage_left(stage):
    """After it, what is left of chains a tenth and 6 degrees off is a tenth of that, and of the residue a fifth."""
    config = HardwareConfig(gain_std_db=0.8, phase_std_deg=6.0, leakage_residue=0.01)
    front = build_front_end(config, RADIO, RECEIVER, rng=rng(4))
    motion, recorded = stage.scene.agent, []
    for cycle in range(0, 30, 3):
        heard = receive(stage.paths, cycle, float(motion.heading[cycle]), RADIO, RECEIVER)
        recorded.append(
            capture(heard, RADIO, RECEIVER, front, direct_gain(stage.paths, cycle), rng=rng(cycle))[0].samples
        )
    found = calibrate(recorded, stage.body, RADIO, RECEIVER)
    product = found.matrix @ front.matrix
    product /= np.mean(np.diag(product))
    before = front.matrix / np.mean(np.diag(front.matrix)) - np.eye(16)
    assert np.linalg.norm(product - np.eye(16)) < 0.1 * np.linalg.norm(before)
    residue = direct_gain(stage.paths, 0) * np.sqrt(RADIO.energy / 128) * front.residue
    assert np.linalg.norm(found.residue - residue) < 0.2 * np.linalg.norm(residue)


def test_a_bound_driven_receiver_has_no_hardware():
    with pytest.raises(ConfigError, match=r"hardware: set.*waveform"):
        load_spec(ROOT / "pipelines" / "trace_then_slam.toml", ["receiver.estimator=bound", "hardware.clip_rms=3.0"])
    with pytest.raises(ConfigError, match=r"hardware.coupling"):
        HardwareConfig(coupling=0.5)
