"""Floor 5: the receiver. Received signal, noise, hardware, and multipath components with their standard deviations."""

from rislam_rt.measurement.calibrate import calibrate
from rislam_rt.measurement.components import path_std
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.detection_threshold import build_sensor
from rislam_rt.measurement.hardware import FrontEnd, HardwareConfig, build_front_end, expected_distortion
from rislam_rt.measurement.noise import paper_snr_db, reference_gain, with_reference_snr
from rislam_rt.measurement.received_paths import Clutter, Received, receive
from rislam_rt.measurement.received_signal import num_tones, to_samples
from rislam_rt.measurement.receiver import measure
from rislam_rt.measurement.signal_dataset import NO_COMPONENT, load_signals, signals_dataset
from rislam_rt.measurement.tracking import init_tracks, step_tracks
from rislam_rt.measurement.waveform_receiver import capture, find_components
from rislam_rt.model import detection_probability

__all__ = [
    "NO_COMPONENT", "Clutter", "FrontEnd", "HardwareConfig", "Received", "ReceiverConfig",
    "build_front_end", "build_sensor", "calibrate", "capture", "detection_probability", "expected_distortion",
    "find_components", "init_tracks", "load_signals", "measure", "num_tones", "paper_snr_db", "path_std",
    "receive", "reference_gain", "signals_dataset", "step_tracks", "to_samples", "with_reference_snr",
]  # fmt: skip
