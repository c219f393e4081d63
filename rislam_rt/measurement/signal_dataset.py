"""Data sets of received signals: samples, the components that the receiver found in them, and their true paths."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.measurement import waveform_receiver
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received_paths import receive
from rislam_rt.measurement.tracking import init_tracks, step_tracks
from rislam_rt.model import Paths, RadioConfig, Trajectory
from rislam_rt.storage.netcdf import Entry, padded, read_dataset, variables
from rislam_rt.waveform import subcarrier_frequencies

if TYPE_CHECKING:
    import xarray as xr

NO_COMPONENT = -9
"""Fill value of integer variables of a signals data set where a cycle has fewer components than another."""
SCHEMA: dict[str, Entry] = {
    "samples": (("time", "capture", "antenna", "tone"), "sqrt(J)", "received tones, noise of variance noise_variance"),
    "noise_variance": (("time", "capture"), "J", "variance of the noise in a tone, converters included"),
    "heard": (("time", "path"), "1", "truth: whether the array hears the path, 1 or 0"),
    "capture": (("capture",), "1", "0 as received (or the sum of all codes), 1 + q difference of panel q"),
    "frequency": (("tone",), "Hz", "baseband frequency of each tone"),
    "antenna_position": (("antenna", "xyz"), "m", "element positions in the body frame, about the array's centre"),
    "receiver_heading": (("time",), "rad", "heading of the body about z"),
    "found_tau": (("time", "component"), "s", "delay"),
    "found_cosines": (("time", "component", "cosine"), "1", "direction cosines along body x and y"),
    "found_gain": (("time", "component"), "1", "complex gain, carrier phase included"),
    "found_tau_std": (("time", "component"), "s", "standard deviation of found_tau"),
    "found_cosines_std": (("time", "component", "cosine"), "1", "standard deviation of found_cosines"),
    "found_amplitude_std": (("time", "component"), "1", "standard deviation of |found_gain|"),
    "found_from_panel": (("time", "component"), "1", "probability that it ran over the panel, -9 no component"),
    "found_which_panel": (("time", "component"), "1", "number of that panel, -9 no component; left out with one"),
    "found_label": (("time", "component"), "1", "the tracker's label, -9 no component"),
    "found_path": (("time", "component"), "1", "truth, for scoring only: column of the path, -1 clutter, -9 none"),
}
"""Dimensions, unit and meaning of a signals data set's variables; complex ones are stored as `_real` and `_imag`."""


def signals_dataset(
    paths: Paths, trajectory: Trajectory, radio: RadioConfig, config: ReceiverConfig, *, rng: np.random.Generator,
    on_cycle: Callable[[], None] | None = None,
) -> "xr.Dataset":  # fmt: skip
    """Data set of received signals: samples of every cycle, the tracked components found in them, and the truth.

    Variables as in `SCHEMA`; the radio and the receiver are in the attributes. `on_cycle` is called after each cycle.
    """
    samples, noise, found, labels, truth, over_panel, which = [], [], [], [], [], [], []
    heard = np.zeros((paths.num_cycles, paths.num_paths), dtype=np.int8)
    shift = doppler_shift(paths, trajectory, radio.wavelength)
    tracks, last, previous = init_tracks(), trajectory.time[0], None
    for cycle in range(paths.num_cycles):
        received = receive(paths, cycle, float(trajectory.heading[cycle]), radio, config, shift[cycle])
        captures = waveform_receiver.capture(received, radio, config, rng=rng)
        components = waveform_receiver.find_components(captures, radio, config, previous)
        previous = waveform_receiver.to_measurement(components, radio, config)
        step = float(trajectory.time[cycle] - last)
        tracks, label = step_tracks(tracks, previous, step)
        last = trajectory.time[cycle]
        samples.append(np.array([one.samples for one in captures], dtype=np.complex64))
        noise.append([one.noise_psd for one in captures])
        heard[cycle, received.path] = 1
        found.append(components)
        labels.append(label)
        truth.append(waveform_receiver.true_paths(components, received, radio, config))
        over_panel.append(np.zeros(len(components.tau)) if previous.from_panel is None else previous.from_panel)
        which.append(previous.panel)
        if on_cycle is not None:
            on_cycle()
    values: dict[str, Any] = {
        "samples": np.array(samples),
        "noise_variance": np.array(noise),
        "heard": heard,
        "capture": np.arange(len(samples[0])),
        "frequency": subcarrier_frequencies(samples[0][0].shape[1], radio.bandwidth),
        "antenna_position": radio.array.positions(radio.wavelength),
        "receiver_heading": trajectory.heading,
        "found_label": padded(labels, NO_COMPONENT),
        "found_path": padded(truth, NO_COMPONENT),
        "found_from_panel": padded(over_panel, float(NO_COMPONENT)),
    }
    if config.alternation and config.panels > 1:
        values["found_which_panel"] = padded(which, NO_COMPONENT)
    for name in waveform_receiver.DetectedComponents._fields[:-1]:
        values[f"found_{name}"] = padded([getattr(one, name) for one in found], 0.0)
    return _dataset(values, radio, config)


def load_signals(path: str | Path) -> "xr.Dataset":
    """Read a data set of received signals from NetCDF, real and imaginary parts joined to complex variables.

    Raises
    ------
    StoreError
        The file is missing or not a readable data set.
    """
    missing = "write one with 'rislam-rt trace SCENE --signals'"
    data = read_dataset(Path(path), missing=missing, damaged="write it again")
    names = [str(name)[:-5] for name in data.data_vars if str(name).endswith("_real")]
    joined = {name: data[f"{name}_real"] + 1j * data[f"{name}_imag"] for name in names}
    return data.drop_vars([f"{name}{part}" for name in names for part in ("_real", "_imag")]).assign(joined)


def _dataset(values: dict[str, Any], radio: RadioConfig, config: ReceiverConfig) -> "xr.Dataset":
    """Data set of received signals from the given variables, radio and receiver settings as attributes."""
    import xarray as xr

    attributes = {f"radio_{key}": value for key, value in asdict(radio).items() if key not in ("array", "antennas")}
    for part in ("array", "antennas"):
        attributes |= {f"{part}_{key}": value for key, value in asdict(getattr(radio, part)).items()}
    # NetCDF attributes know numbers and text, not truth values.
    settings = {key: int(value) if isinstance(value, bool) else value for key, value in asdict(config).items()}
    attributes |= {f"receiver_{key}": value for key, value in settings.items()}
    return xr.Dataset(variables(values, SCHEMA), attrs={"Conventions": "CF-1.11", **attributes})
