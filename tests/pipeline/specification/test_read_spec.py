"""Pipeline files: what they become, and what is said of a bad one."""

import re
from dataclasses import fields

import numpy as np
import pytest

from rislam_rt.design import DesignConfig
from rislam_rt.errors import ConfigError
from rislam_rt.measurement import HardwareConfig, ReceiverConfig, reference_gain
from rislam_rt.pipeline import PipelineSpec, load_spec
from rislam_rt.pipeline.specification.pipeline_spec import (
    DesignSection,
    HardwareSection,
    NestedSection,
    ReceiverSection,
    SlamSection,
    build_settings,
)
from rislam_rt.shipped import find_pipeline
from rislam_rt.slam import NestedConfig, SlamConfig

MINIMAL = 'name = "small"\n'


@pytest.fixture
def write(tmp_path):
    def _write(text):
        path = tmp_path / "pipeline.toml"
        path.write_text(text)
        return path

    return _write


def test_defaults_are_those_of_the_records(write):
    settings = build_settings(load_spec(write(MINIMAL)))
    assert settings.slam == SlamConfig()
    assert settings.receiver == ReceiverConfig()
    assert settings.design == DesignConfig(certify=False)


@pytest.mark.parametrize(
    ("section", "record", "without"),
    [
        (SlamSection, SlamConfig, {"nested"}),  # a table of its own
        (NestedSection, NestedConfig, set()),
        (ReceiverSection, ReceiverConfig, {"slot", "panels"}),  # it is `budget.measure_s`
        (HardwareSection, HardwareConfig, set()),
        (DesignSection, DesignConfig, {"certify"}),
    ],
)
def test_every_setting_of_a_record_can_be_given(section, record, without):
    assert {f.name for f in fields(record)} - without <= set(section.model_fields)


def test_units_become_si(write):
    radio = build_settings(load_spec(write(MINIMAL + "[radio]\ncarrier_ghz = 28.0\ntx_gain_db = 20.0\n"))).radio
    assert radio.carrier == 28e9
    assert radio.tx_gain == pytest.approx(100.0)


@pytest.mark.parametrize(("given", "expected"), [("", 13.0), ("[radio]\nreference_snr_db = -4.0\n", -4.0)])
def test_noise_is_set_by_the_reference_sphere(write, given, expected):
    radio = build_settings(load_spec(write(MINIMAL + given))).radio
    snr = 10.0 * np.log10(radio.integrated_snr(np.array(reference_gain(radio))))
    assert snr == pytest.approx(expected, abs=1e-9)


def test_noise_density_is_taken_as_it_is(write):
    assert build_settings(load_spec(write(MINIMAL + "[radio]\nnoise_psd = 2e-11\n"))).radio.noise_psd == 2e-11


def test_override_wins_over_the_file(write):
    path = write(MINIMAL + "seed = 1\n[radio]\ncarrier_ghz = 5.0\n")
    spec = load_spec(path, ["seed=9", "radio.carrier_ghz=28.0", "channel=image_source", 'schemes=["no_ris"]'])
    assert (spec.seed, spec.radio.carrier_ghz, spec.channel, spec.schemes) == (9, 28.0, "image_source", ["no_ris"])


@pytest.mark.parametrize(
    ("text", "place", "hint"),
    [
        ("", "name", "missing"),
        (MINIMAL + "[radio]\ncarier_ghz = 5.0\n", "radio.carier_ghz", "carrier_ghz"),
        (MINIMAL + "[radio.array]\nrows = 0\n", "radio.array.rows", "give at least 1"),
        (MINIMAL + '[slam]\nnum_samples = "many"\n', "slam.num_samples", "many"),
        (MINIMAL + "[slam]\nnum_samples = -3\n", "slam.num_samples", "-3"),
        (MINIMAL + "[radio]\nreference_snr_db = 1.0\nnoise_psd = 1.0\n", "radio", "not both"),
        (MINIMAL + 'schemes = ["random", "random"]\n', "schemes", "at most once"),
        (MINIMAL + 'schemes = ["bp"]\n', "schemes[0]", "optimized"),
        (MINIMAL + "[control]\nloss_probability = 1.5\n", "control.loss_probability", "1.5"),
        ("name = ", "", "not valid TOML"),
    ],
)
def test_bad_file_is_one_line_with_file_and_field(write, text, place, hint):
    path = write(text)
    with pytest.raises(ConfigError) as caught:
        load_spec(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert place in message
    assert hint in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("setting", "cure"),
    [
        ("schemes=optimized,random", """give a list, in quotes: 'schemes=["optimized", "random"]'"""),
        ("schemes=[optimized]", """give a list, in quotes: 'schemes=["optimized"]'"""),
        (r"schemes=own\filter", r"""give a list, in quotes: 'schemes=["own\\filter"]'"""),
        ("radio.carrier_ghz=10e9", "give at most 3000 GHz"),
        ("start.position_std_m=-1", "give at least 0 m"),
        ("cycles=many", "give a whole number"),
        ("radio.bandwidth_ghz=wide", "give a number"),
        ("receiver.merge=3", "give true or false"),
    ],
)
def test_a_value_that_cannot_be_is_told_what_can(write, setting, cure):
    with pytest.raises(ConfigError, match=f"received; {re.escape(cure)}$"):
        load_spec(write(MINIMAL), [setting])


def test_a_list_that_is_none_is_told_as_the_file_needs_it(write):
    with pytest.raises(ConfigError, match=r"""schemes: 'exact' received; give a list, schemes = \["exact"\]$"""):
        load_spec(write(MINIMAL + 'schemes = "exact"\n'))


@pytest.mark.parametrize(
    "setting", ["", "seed", "=3", "a b=1", "name.x=1", "seed=seven", "radio.x=1", "design.iterations=0"]
)
def test_bad_override_is_laid_to_the_command_line(write, setting):
    with pytest.raises(ConfigError, match="--set"):
        load_spec(write(MINIMAL), [setting])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (({"cycles": 3},), "path: dict received; give a str or PathLike"),
        (("trace_then_slam", "cycles=3"), "overrides: 'cycles=3' received; give a list of settings, e.g. ['radio."),
        (("trace_then_slam", {"cycles": 3}), "overrides: dict received; give a list of settings, e.g. ['radio."),
    ],
)
def test_an_argument_of_another_type_is_one_line(arguments, said):
    with pytest.raises(ConfigError) as refused:
        load_spec(*arguments)
    assert str(refused.value).startswith(said)


@pytest.mark.parametrize("setting", ["slam.use_vt=maybe", "motion.sigma_a_m_s2=-3", "bp_slam.sigma_a=-1"])
def test_a_setting_handed_on_to_other_sections_is_complained_about_once(write, setting):
    with pytest.raises(ConfigError) as caught:
        load_spec(write(MINIMAL), [setting])
    assert len(caught.value.lines) == 1
    assert caught.value.lines[0].startswith(f"--set: {setting.partition('=')[0]}")


def test_a_built_in_pipeline_is_found_by_name_and_a_file_of_that_name_first(tmp_path, monkeypatch):
    """It said: no such pipeline file; did you mean 'trace_then_slam'?"""
    monkeypatch.chdir(tmp_path)
    assert load_spec("trace_then_slam", ["seed=3"]) == load_spec(find_pipeline("trace_then_slam"), ["seed=3"])
    with pytest.raises(ConfigError, match=r"no such pipeline file; did you mean 'trace_then_slam'\?"):
        load_spec("trace_then_slan")
    (tmp_path / "trace_then_slam").write_text(MINIMAL)
    assert load_spec("trace_then_slam").name == "small"


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(ConfigError, match="no such pipeline file"):
        load_spec(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_spec(tmp_path)


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"\xff\xfen\x00", "not text in UTF-8 (byte 0); save it as UTF-8"),
     (b'name = "a"\n[[reflector]]\nname = "b"\n', "is a scene file, not a pipeline; give trace_then_slam --scene ")],
)  # fmt: skip
def test_a_file_that_is_no_pipeline_is_said_to_be_what_it_is(tmp_path, content, says):
    (tmp_path / "mine.toml").write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        load_spec(tmp_path / "mine.toml")
    assert says in str(caught.value)
    assert len(caught.value.lines) == 1


def test_a_scene_or_a_run_in_a_pipelines_place_is_said_what_to_give(tmp_path):
    for file, says in (("config.toml", f"give {tmp_path / 'config.toml'}"), ("scene.toml", f"--scene {tmp_path}")):
        (tmp_path / file).write_text("")
        with pytest.raises(ConfigError, match=r"cannot be read \(Is a directory\)") as caught:
            load_spec(tmp_path)
        assert str(caught.value).endswith(says)


def test_specification_survives_its_own_dump(write):
    spec = load_spec(write(MINIMAL + "[control]\ndelay_cycles = 2\n"))
    assert PipelineSpec.model_validate(spec.model_dump(mode="json")) == spec
