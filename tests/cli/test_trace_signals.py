"""`trace --signals`: a data set that says what was sent through which paths, and nothing written when it cannot be."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rislam_rt.errors import ConfigError
from rislam_rt.measurement import load_signals
from rislam_rt.model import PathKind
from rislam_rt.pipeline.run_datasets import dataset_to_paths
from rislam_rt.pipeline.signal_simulation import coded_paths, load_signals_spec, signals_size
from rislam_rt.scene import load_scene
from rislam_rt.storage.netcdf import read_dataset

SCENE = Path(__file__).parents[2] / "scenes" / "paper_room"
FEW = ("--signals", "--channel", "image_source", "--depth", 1, "--cycles", 401, "--stride", 200)


def synthesis(data):
    """Noiseless tones (cycle, antenna, tone) from the true paths in the file and its attributes alone."""
    heading = data["true_heading"].values
    turn = np.moveaxis(
        np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]), -1, 0
    )  # body to room; the array lies in the body's horizontal plane
    cosines = data["arrival"].values[..., :2] @ turn
    wavelength = 299_792_458.0 / data.attrs["radio_carrier"]
    elements = data["antenna_position"].values[:, :2]
    antennas = np.exp(2j * np.pi / wavelength * np.einsum("lx,kpx->klp", elements, cosines))
    gain = np.where(data["heard"].values > 0, data["gain"].values, 0.0)
    phase = np.exp(-2j * np.pi * data["tau"].values[..., None] * data["frequency"].values)
    scale = np.sqrt(data.attrs["radio_energy"] / data.sizes["tone"])
    return scale * np.einsum("klp,kp,kpm->klm", antennas, gain, phase)


@pytest.mark.parametrize("alternation", [False, True])
def test_samples_are_those_of_the_true_paths_in_noise(run, tmp_path, alternation):
    code, out, err = run(
        "trace", SCENE, *FEW, "--set", f"receiver.alternation={str(alternation).lower()}", "--json", "t.json"
    )
    assert code == 0
    assert "paper_room-signals.nc" in out
    assert "0.1 MB" in err if alternation else "0.0 MB" in err
    data = load_signals(tmp_path / "paper_room-signals.nc")
    plain = xr.load_dataset(tmp_path / "paper_room-signals.nc", engine="h5netcdf")
    np.testing.assert_array_equal(plain["samples_real"] + 1j * plain["samples_imag"], data["samples"])
    assert data["samples"].dims == ("time", "capture", "antenna", "tone")
    assert data["samples"].shape == (3, 1 + alternation, 16, 128)
    assert np.iscomplexobj(data["samples"])
    # sum and difference of the two codes have the walls' and the panel's paths
    panel = data["kind"].isin([PathKind.RIS, PathKind.VRIS])
    parts = [data.assign(heard=data["heard"] * ~panel), data.assign(heard=data["heard"] * panel)]
    expected = np.stack([synthesis(part) for part in (parts if alternation else [data])], axis=1)
    noise = (data["samples"].values - expected) / np.sqrt(data["noise_variance"].values)[..., None, None]
    count = noise[:, 0].size
    for capture in range(1 + alternation):
        # mean power of n circular normal numbers: standard deviation 1 / sqrt(n)
        assert np.mean(np.abs(noise[:, capture]) ** 2) == pytest.approx(1.0, abs=5.0 / np.sqrt(count))
        assert abs(np.mean(noise[:, capture] ** 2)) < 5.0 / np.sqrt(count)
    # single precision of a signal 60 dB above the noise stays 80 dB below the noise
    assert np.abs(noise).max() < 6.0
    content = json.loads((tmp_path / "t.json").read_text())["signals"]
    assert (content["cycles"], content["captures"], content["antennas"], content["tones"]) == (
        3,
        1 + alternation,
        16,
        128,
    )


def test_there_is_a_capture_for_the_codes_sum_and_one_for_each_panel():
    """Without a panel, or with its code held, the sum is all there is; a panel without half a turn is refused."""
    one, two = load_scene(SCENE), load_scene(SCENE.parent / "two_panels")
    plain, held = load_signals_spec([]), load_signals_spec(["receiver.alternation=false"])
    assert [signals_size(room, plain).captures for room in (replace(one, ris=None), one, two)] == [1, 2, 3]
    assert [signals_size(room, held).captures for room in (one, two)] == [1, 1]
    odd = replace(one, ris=replace(one.ris, spec=replace(one.ris.spec, levels=3)))
    with pytest.raises(ConfigError, match=r"receiver\.alternation = false"):
        coded_paths(odd, "image_source", 0, plain, rng=np.random.default_rng(0))
    few = replace(odd, agent=odd.agent[:1])
    assert coded_paths(few, "image_source", 0, held, rng=np.random.default_rng(0)).num_cycles == 1


def test_estimates_lie_at_the_true_paths_that_they_name(run, tmp_path):
    assert run("trace", SCENE, *FEW, "--out", "few.nc")[0] == 0
    data = load_signals(tmp_path / "few.nc")
    paths = dataset_to_paths(read_dataset(tmp_path / "few.nc"))
    cycle, component = np.nonzero(data["found_path"].values >= 0)
    path = data["found_path"].values[cycle, component]
    found = data.isel(time=xr.DataArray(cycle), component=xr.DataArray(component))
    walls = paths.kind[path] == PathKind.VT
    assert walls.sum() > 10
    # walls stand 20 dB and more above the threshold: a fiftieth of a cell, and most within three deviations
    error = found["found_tau"].values - paths.tau[cycle, path]
    assert np.median(np.abs(error[walls])) < 0.02 / data.attrs["radio_bandwidth"]
    assert np.mean(np.abs(error) < 3.0 * found["found_tau_std"].values) > 0.8
    empty = data["found_path"].values < -1
    assert np.all(data["found_label"].values[empty] == -9)


def test_code_focuses_on_the_agent(run, tmp_path):
    gains = {}
    for kind in ("focused", "random", "zero"):
        assert run("trace", SCENE, *FEW, "--cycles", 1, "--set", f"code={kind}", "--out", f"{kind}.nc")[0] == 0
        paths = dataset_to_paths(read_dataset(tmp_path / f"{kind}.nc"))
        gains[kind] = np.abs(paths.gain[:, paths.kind == PathKind.RIS])
    assert np.all(gains["focused"] > 2.0 * gains["random"])
    assert np.all(gains["focused"] >= gains["zero"])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--signals", "--cycles", 601), "--cycles: 601"),
        (("--set", "receiver.alternation=true"), "--signals"),
        (("--set", "radio.tx_pattern=yagi"), "radio.tx_pattern"),
        (("--signals", "--set", "receiver.estimator=bound"), "receiver.estimator"),
        (("--signals", "--set", "radio.bandwith_ghz=2"), "bandwidth_ghz"),
        (("--signals", "--set", "design.method=exact"), "design"),
    ],
)
def test_bad_settings_are_one_line_and_write_nothing(run, tmp_path, options, told):
    code, _, err = run("trace", SCENE, "--channel", "image_source", *options)
    assert code == 2
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_before_the_work(run, tmp_path, monkeypatch):
    from collections import namedtuple

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr("rislam_rt.pipeline.signal_simulation.shutil.disk_usage", lambda _: usage(10, 10, 0))
    code, _, err = run("trace", SCENE, *FEW)
    assert code == 4
    assert "GB free" in err
    assert not list(tmp_path.iterdir())
