"""The list of all settings says what the models say."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from rislam_rt.cli.config import command
from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.settings_list import Setting, explain, list_settings
from rislam_rt.shipped import find_pipeline, room_beside, shipped_pipelines
from rislam_rt.studies import load_any

SETTINGS = {one.key: one for one in list_settings(PipelineSpec)}


@pytest.mark.parametrize("file", shipped_pipelines().values(), ids=lambda file: file.stem)
def test_every_setting_of_every_pipeline_has_a_meaning(file: Path) -> None:
    settings = list_settings(type(load_any(file)))
    assert not [one.key for one in settings if not one.meaning]


@pytest.mark.parametrize("file", shipped_pipelines().values(), ids=lambda file: file.stem)
def test_what_is_printed_is_the_same_pipeline(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command(file)
    again = tmp_path / "printed.toml"
    again.write_text(capsys.readouterr().out)
    assert _rooms_found(load_any(again), tmp_path) == _rooms_found(load_any(file), file.parent)


def _rooms_found(spec: BaseModel, folder: Path) -> str:
    """A specification with the folders of its rooms as they are found from that of its file."""

    def find(value: Any, key: str = "") -> Any:
        if isinstance(value, dict):
            return {name: find(item, name) for name, item in value.items()}
        if isinstance(value, list):
            return [find(item, key) for item in value]
        return str(room_beside(folder, value).resolve()) if value and key in ("scene", "scenes") else value

    return repr(find(spec.model_dump()))


def test_no_setting_is_left_out() -> None:
    assert set(SETTINGS) == set(_leaves(PipelineSpec(name="x"), ""))


@pytest.mark.parametrize(
    ("key", "default", "allowed", "unit"),
    [
        ("depth", 2, "at least 0, at most 4", ""),
        ("radio.carrier_ghz", 10.0, "at least 0.001, at most 3000", "GHz"),
        ("channel", "traced", "one of traced, image_source", ""),
        # What follows are the fields of records.
        ("receiver.converter_bits", 0, "at least 0, at most 32", ""),
        ("receiver.min_delay", 0.0, "at least -1e-06, at most 1", ""),
        ("receiver.max_delay", 80e-9, "above 0, at most 1", ""),
        ("design.population", 50, "at least 2", ""),
        ("design.elite", 10, "at least 0", ""),
        ("design.mutation", 0.02, "at least 0, at most 1", ""),
        ("slam.height", "known", "one of known, estimated", ""),
        ("bp_slam.detection_probability", 0.7, "above 0, below 1", ""),
    ],
)
def test_default_range_and_unit(key: str, default: object, allowed: str, unit: str) -> None:
    one = SETTINGS[key]
    assert (one.default, one.allowed, one.unit) == (default, allowed, unit)


def found(key: str) -> list[str]:
    """Keys of the settings that `--explain KEY` tells about."""
    return [one.key for one in explain(list(SETTINGS.values()), key)]


def test_a_table_is_told_whole_before_settings_of_its_name_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    """Of `motion` only `slam.motion` was told."""
    assert found("motion") == ["motion.sigma_a_m_s2", "motion.look_std_deg", "slam.motion"]
    assert found("told") == [key for key in SETTINGS if key.startswith("told.")] + ["hardware.told"]
    assert found("radio.array") == [key for key in SETTINGS if key.startswith("radio.array.")]
    command(find_pipeline("trace_then_slam"), explain="motion")
    told = [part.partition(" ")[0] for part in capsys.readouterr().out.split("\n\n")]
    assert told == found("motion")


def test_one_setting_is_found_by_its_last_name() -> None:
    assert found("mutation") == ["design.mutation"]
    assert found("name") == ["name"]
    with pytest.raises(ConfigError, match=r"give one of slam\.sigma_a"):
        explain(list(SETTINGS.values()), "sigma_a")
    with pytest.raises(ConfigError, match=r"did you mean 'radio\.carrier_ghz'"):
        explain(list(SETTINGS.values()), "carier_ghz")
    with pytest.raises(ConfigError, match=r"there are .*radio\.reference_snr_db"):
        explain(list(SETTINGS.values()), "snr")


def _leaves(section: BaseModel, prefix: str) -> list[str]:
    found: list[str] = []
    for name in type(section).model_fields:
        value = getattr(section, name)
        found += _leaves(value, f"{prefix}{name}.") if isinstance(value, BaseModel) else [f"{prefix}{name}"]
    return found


def test_a_setting_knows_whether_it_must_be_given() -> None:
    assert SETTINGS["name"].required
    assert isinstance(SETTINGS["name"], Setting)
    assert not SETTINGS["seed"].required
