"""The table `[radio]`: antennas and power of a pipeline file, where they arrive, and who is told of them."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.errors import ConfigError
from rislam_rt.model import Antennas, RadioConfig
from rislam_rt.model.radio import CARRIERS
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.assumed_model import tell_settings
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.pipeline.specification.radio import RadioSection, build_radio
from rislam_rt.pipeline.specification.read_pipeline import load_radio

PIPELINE = Path(__file__).parents[3] / "pipelines" / "trace_then_slam.toml"
SECTORS = ("radio.tx_pattern=dipole", "radio.rx_pattern=tr38901", "radio.tx_polarization=H")


def test_by_default_antennas_are_those_that_nobody_names():
    assert build_radio(RadioSection()).antennas == RadioConfig().antennas == Antennas()
    assert load_radio(()) == RadioConfig()


def test_a_carrier_in_gigahertz_is_refused_in_the_range_of_a_pipeline_file():
    for carrier in (10, 9.9e5, 3.1e12):
        with pytest.raises(ConfigError) as refused:
            RadioConfig(carrier=carrier, bandwidth=1)
        said = f"radio.carrier: {carrier:g} Hz received; give 1e+06 to 3e+12 Hz, 10e9 for 10 GHz"
        assert str(refused.value) == said
    ends = (build_radio(RadioSection(carrier_ghz=ghz, bandwidth_ghz=1e-3)).carrier for ghz in (1e-3, 3000.0))
    assert tuple(ends) == CARRIERS


def test_patterns_and_polarisations_arrive_in_the_radio():
    assert load_radio(SECTORS).antennas == Antennas("dipole", "tr38901", "H")
    assert load_radio(["radio.rx_polarization=H"]).antennas.of_rx == ("iso", "H")


def test_a_run_hears_through_its_antennas_and_its_belief_is_told_others(run_short, room):
    told = ('told.antennas="iso"', 'schemes=["random"]', "cycles=3", "depth=1")
    result, plain = run_short(*SECTORS, *told), run_short(*told)
    exact = ImageSourceChannel(room, load_radio(SECTORS), 1).paths(room.agent[:3])
    np.testing.assert_array_equal(result.paths.gain, exact.gain)
    assert not np.array_equal(result.paths.gain, plain.paths.gain)
    spec = load_spec(PIPELINE, [*SECTORS, told[0]])
    settings = tell_settings(build_settings(spec), spec.told)
    assert settings.radio.antennas == settings.sensor.radio.antennas == Antennas()
    assert build_settings(spec).radio.antennas == load_radio(SECTORS).antennas


@pytest.mark.parametrize("setting", ["radio.tx_pattern=dipole", "radio.rx_polarization=H"])
def test_antennas_that_no_filter_can_reckon_with_have_to_be_told_as_others(setting):
    with pytest.raises(ConfigError, match=r"no estimator can be told of; give told.antennas = 'iso'"):
        load_spec(PIPELINE, [setting])
    assert load_spec(PIPELINE, [setting, "told.antennas=iso"]).told.antennas == "iso"


def test_extra_paths_know_no_antennas():
    with pytest.raises(ConfigError, match="extras: traced between isotropic, vertical antennas alone"):
        load_spec(PIPELINE, [SECTORS[0], "told.antennas=iso", "extras.diffraction=true"])


def test_a_power_is_an_energy_over_the_sounding():
    """20 dBm over 1 us are 100 nJ, which is what the same energy makes of every SNR."""
    power = load_radio(["radio.power_dbm=20.0", "radio.sounding_s=1e-6", "radio.noise_psd=4e-21"])
    energy = load_radio(["radio.energy_j=1e-7", "radio.noise_psd=4e-21"])
    assert power.energy == pytest.approx(1e-7, rel=1e-15)
    np.testing.assert_allclose(power.integrated_snr(np.array([1e-4])), energy.integrated_snr(np.array([1e-4])))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["radio.power_dbm=20.0"], "'power_dbm' and 'sounding_s' together"),
        (["radio.sounding_s=1e-6"], "'power_dbm' and 'sounding_s' together"),
        (["radio.power_dbm=20.0", "radio.sounding_s=1e-6"], "give 'noise_psd'"),
        (["radio.power_dbm=20.0", "radio.sounding_s=1e-6", "radio.energy_j=2.0"], "not both"),
        (["radio.tx_pattern=yagi"], "give 'iso', 'dipole', 'hw_dipole' or 'tr38901'"),
        (["receiver.slots=1"], "unknown key"),
    ],
)
def test_what_contradicts_itself_is_said(settings, words):
    with pytest.raises(ConfigError, match=words):
        load_radio(settings)
