"""Data sets of received signals: true paths under stated phase codes, samples, and the components found in them."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from rislam_rt.design import focus_codes
from rislam_rt.errors import ConfigError, StoreError
from rislam_rt.measurement import NO_COMPONENT, ReceiverConfig, num_tones, signals_dataset
from rislam_rt.measurement.config import check_half_turn
from rislam_rt.model import PathKind, Paths, RadioConfig, RisCode, Scene
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.run_datasets import paths_to_dataset
from rislam_rt.pipeline.specification.pipeline_spec import ReceiverSection, build_receiver
from rislam_rt.pipeline.specification.radio import RadioSection, build_radio
from rislam_rt.pipeline.specification.read_pipeline import build_spec, settings_table
from rislam_rt.pipeline.specification.section import Section

if TYPE_CHECKING:
    import xarray as xr

BYTES_PER_SAMPLE = 8
"""Bytes of one complex sample: real and imaginary part in single precision."""


class SignalsSpec(Section):
    """Settings of a data set of received signals: seed, phase codes, radio and receiver."""

    seed: Annotated[int, Field(ge=0, lt=2**63)] = 7
    code: Literal["focused", "random", "zero"] = "focused"
    """Phase codes of the panel: focused on the agent in every cycle, random in every cycle, or level 0 throughout."""
    radio: RadioSection = RadioSection()
    receiver: ReceiverSection = ReceiverSection(estimator="waveform")


class SignalsSize(NamedTuple):
    """Size of the samples in a data set of received signals."""

    cycles: int
    captures: int
    antennas: int
    tones: int

    @property
    def num_bytes(self) -> int:
        """Number of bytes that the samples of a data set of received signals take."""
        return self.cycles * self.captures * self.antennas * self.tones * BYTES_PER_SAMPLE

    def __str__(self) -> str:
        return (
            f"{self.cycles} cycles x {self.captures} captures x {self.antennas} antennas x {self.tones} tones, "
            f"{self.num_bytes / 1e6:.1f} MB"
        )


def load_signals_spec(overrides: Sequence[str]) -> SignalsSpec:
    """Settings of a data set of received signals: the defaults, changed by `key=value` overrides (dotted keys).

    Raises
    ------
    ConfigError
        A key is unknown, or a value of the wrong type or out of range. One line.
    """
    table = settings_table(overrides, {"receiver": {"estimator": "waveform"}})
    return build_spec(table, SignalsSpec, signal_settings)


def signal_settings(spec: SignalsSpec, scene: Scene | None = None) -> tuple[RadioConfig, ReceiverConfig]:
    """Radio and receiver of a data set of signals, in SI units and linear ratios, for as many panels as the scene has;
    without one no codes alternate.

    Raises
    ------
    ConfigError
        A value is out of range, or the receiver is one that makes no samples.
    """
    receiver = build_receiver(spec.receiver, len(scene.panels) if scene else 1)
    if receiver.estimator != "waveform":
        raise ConfigError(f"receiver.estimator: '{receiver.estimator}' received; samples need 'waveform'")
    return build_radio(spec.radio), receiver


def signals_size(scene: Scene, spec: SignalsSpec) -> SignalsSize:
    """Size that the samples of a scene's data set of received signals will have."""
    radio, receiver = signal_settings(spec, scene)
    return SignalsSize(len(scene.agent), receiver.num_captures, radio.array.num_antennas, num_tones(radio, receiver))


def check_space(file: Path, size: SignalsSize) -> None:
    """Check that the samples of received signals that are to be simulated fit on the disk of `file`.

    Raises
    ------
    StoreError
        They do not.
    """
    folder = next(part for part in file.absolute().parents if part.is_dir())
    free = shutil.disk_usage(folder).free
    if size.num_bytes > free:
        raise StoreError(
            f"{file}: {size.num_bytes / 1e9:.1f} GB needed, {free / 1e9:.1f} GB free; give fewer --cycles, a --stride "
            "or another disk"
        )


def coded_paths(scene: Scene, channel: str, depth: int, spec: SignalsSpec, *, rng: np.random.Generator) -> Paths:
    """True paths of a scene for a data set of received signals, with gains under the phase code of each cycle.

    Raises
    ------
    ConfigError
        The receiver is to alternate and the panel has no phase level of pi.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    radio, receiver = signal_settings(spec, scene)
    if scene.ris is not None and receiver.alternation:
        check_half_turn(scene.ris.spec.levels)
    tracer = build_channel(channel, scene, radio, depth)
    paths = tracer.paths(scene.agent)
    chosen = panel_codes(scene, paths, spec.code, rng=rng)
    return paths if chosen is None else tracer.respond(paths, chosen)


def panel_codes(scene: Scene, paths: Paths, kind: str, *, rng: np.random.Generator) -> RisCode | None:
    """Phase codes (K, N, M) under which signals are simulated, one a cycle; None without a RIS panel, or for its level
    0.

    `kind`: `focused` on the agent (random where every path over the panel has walls), `random` or `zero`.
    """
    if scene.ris is None or kind == "zero":
        return None
    panel = scene.ris.spec
    shape = (paths.num_cycles, panel.rows, panel.cols)
    if kind == "random" or paths.ris is None or not (paths.kind == PathKind.RIS).any():
        return RisCode(rng.integers(panel.levels, size=shape), panel.levels)
    return focus_codes(paths, panel.levels)


def build_signals(
    scene: Scene, paths: Paths, spec: SignalsSpec, *, rng: np.random.Generator, on_cycle: Callable[[], None]
) -> "xr.Dataset":
    """Data set of true trajectory, true paths, received samples and the components that the receiver found in them."""
    radio, receiver = signal_settings(spec, scene)
    signals = signals_dataset(paths, scene.agent, radio, receiver, rng=rng, on_cycle=on_cycle)
    truth = paths_to_dataset(paths, scene.agent)
    for part in ("gain_real", "gain_imag"):
        truth[part].attrs["long_name"] = "complex gain, carrier phase included, under the cycle's code"
    joined = truth.assign(signals.data_vars).assign_coords(signals.coords)
    return joined.assign_attrs({**signals.attrs, "scene": scene.name, "code": spec.code, "seed": spec.seed})


def mean_components(data: "xr.Dataset") -> float:
    """Mean number of components per cycle that the receiver found in a data set of received signals."""
    return float((data["found_path"] != NO_COMPONENT).sum()) / max(data.sizes["time"], 1)
