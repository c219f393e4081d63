"""The belief is told what the truth is unless `[told]` says otherwise, and nothing goes past the one place."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rislam_rt import slam
from rislam_rt.model import PathKind
from rislam_rt.pipeline import assumed_model, load_spec
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.pipeline.specification.mismatch import AssumedSection
from rislam_rt.pipeline.specification.pipeline_spec import build_settings

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
PAGE = ROOT / "docs" / "told.md"

WRONG: dict[str, tuple[str, tuple[str, ...]]] = {
    "antennas": ('"iso"', ()),  # they are; what others become: tests/pipeline/test_pipeline_radio.py
    "compass_bias_deg": ("2.0", ("heading", "start.heading")),
    "compass_noise_deg": ("1.0", ("heading", "start.heading")),
    "start_scale": ("3.0", ("start.position", "start.velocity")),
    "start_heading_deg": ("2.0", ("start.heading",)),
    "height_m": ("0.1", ("start.position",)),
    "process_noise_scale": ("2.0", ("config.sigma_a",)),
    "time_scale": ("1.01", ("dt",)),
    "tilt_deg": ("2.0", ("measured",)),
    "wobble_deg": ("1.0", ("measured",)),
    "baseline_m": ("0.01", ("body.tx_offset",)),
    "clock_offset_ns": ("1.0", ("measured",)),
    "clock_drift_ns_s": ("0.5", ("measured",)),
    "noise_db": ("3.0", ("sensor.radio.noise_psd",)),
    "gain_db": ("3.0", ("sensor.radio.tx_gain",)),
    "std_scale": ("2.0", ("measured",)),
    "threshold_db": ("3.0", ("sensor.threshold",)),
    "clutter_scale": ("4.0", ("sensor.false_alarms",)),
    "array_scale": ("1.01", ("measured",)),
    "array_bias": ("0.01", ("measured",)),
    "bounces_less": ("1", ("config.max_bounces",)),
    "panel_tilt_deg": ("5.0", ("panel.normal", "panel.up")),
    "panel_turn_deg": ("5.0", ("panel.up",)),
    "panel_spacing_scale": ("1.05", ("panel.spacing",)),
    "panel_element": ("energy", ("panel.element",)),
    "panel_gain_db": ("-3.0", ("panel.amplitude",)),
}
"""For every error of `[told]`: a value, and all that it changes of what an estimator gets."""


@pytest.fixture
def overhear(run_short, monkeypatch):
    """What an estimator is given in a short run under some settings, flat by name."""

    def _overhear(*overrides: str) -> dict[str, Any]:
        heard: dict[str, Any] = {}

        def init(start, body, panel, sensor, config, *, rng):
            for name, record in {
                "start": start,
                "body": body,
                "panel": panel,
                "sensor": sensor,
                "config": config,
            }.items():
                heard.update(_flat(record, name))
            return slam.init(start, body, panel, sensor, config, rng=rng)

        def step(state, measurement, code, dt, heading, config, *, rng):
            rows = heard.setdefault("steps", [])
            seen = [getattr(measurement, field.name) for field in fields(measurement) if field.name != "from_panel"]
            rows.append((np.concatenate([np.ravel(part) for part in seen]), dt, heading, code.index))
            heard.update(_flat(config, "config"))
            return slam.step(state, measurement, code, dt, heading, config, rng=rng)

        monkeypatch.setitem(ESTIMATORS, "slam", ESTIMATORS["slam"]._replace(init=init, step=step))
        run_short('schemes=["random"]', "cycles=4", "depth=1", *overrides)
        steps = heard.pop("steps")
        for name, column in {"measured": 0, "dt": 1, "heading": 2, "code": 3}.items():
            heard[name] = [row[column] for row in steps]
        return heard

    return _overhear


def _flat(record: Any, name: str) -> dict[str, Any]:
    """Fields of a record by dotted name, records within it as well."""
    flat: dict[str, Any] = {}
    for field in fields(record):
        value = getattr(record, field.name)
        flat |= _flat(value, f"{name}.{field.name}") if is_dataclass(value) else {f"{name}.{field.name}": value}
    return flat


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, list):
        return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
    return bool(np.array_equal(one, other))


def test_every_error_changes_what_it_says_and_nothing_else(overhear):
    """One by one: what an estimator gets differs from the default run in the named quantities alone."""
    assert set(WRONG) == set(AssumedSection.model_fields)
    estimated = ('slam.heading="estimated"',)
    two = "cycles=2"  # what drifts has begun to, and time has passed
    plain = {extra: overhear(two, *extra) for extra in ((), estimated)}
    for name, (value, changed) in WRONG.items():
        extra = estimated if name == "start_heading_deg" else ()
        heard = overhear(two, f"told.{name}={value}", *extra)
        differ = {part for part in heard if not _same(heard[part], plain[extra][part])}
        assert differ == set(changed), name


def test_by_default_all_is_told_as_it_is(overhear, room, short_spec):
    heard, motion, settings = overhear(), room.agent, build_settings(short_spec)
    np.testing.assert_array_equal(heard["heading"], motion.heading[:4])
    np.testing.assert_allclose(heard["dt"], [0.0, 0.1, 0.1, 0.1], rtol=1e-9, atol=0.0)  # differences of float times
    for name, record in {"body": motion.body, "panel": room.ris.spec, "sensor": settings.sensor}.items():
        for part, value in _flat(record, name).items():
            assert _same(heard[part], value), part
    assert heard["start.heading"] == motion.heading[0]
    assert heard["start.position"][2] == motion.position[0, 2]  # a known height has no error


def test_the_page_lists_every_error():
    page = PAGE.read_text()
    missing = [name for name in (*AssumedSection.model_fields, "heading_std_deg") if f"`{name}`" not in page]
    assert not missing


def test_a_start_that_errs_more_than_is_told(room):
    """Errors of many draws, over the deviation that is told: three, within five standard errors of 600 values."""
    settings = SimpleNamespace(slam=SimpleNamespace(height="estimated", heading="estimated"))
    start = load_spec(PIPELINE, ["start.heading_std_deg=1.0", "start.position_std_m=0.02"]).start
    section, rng = AssumedSection(start_scale=3.0), np.random.default_rng(1)
    draws = [assumed_model.tell_start(room.agent, 0.0, start, section, settings, rng=rng) for _ in range(200)]
    assert {(prior.position_std, prior.heading_std) for prior in draws} == {(0.02, float(np.radians(1.0)))}
    shift = np.array([prior.position - room.agent.position[0] for prior in draws]) / 0.02
    assert np.std(shift) == pytest.approx(3.0, abs=5.0 * 3.0 / np.sqrt(2 * 600))
    turn = np.array([prior.heading - room.agent.heading[0] for prior in draws]) / np.radians(1.0)
    assert np.std(turn) == pytest.approx(3.0, abs=5.0 * 3.0 / np.sqrt(2 * 200))


def test_a_panel_told_tilted_stays_a_panel(room):
    spec = room.ris.spec
    wrong = assumed_model.tell_panel(spec, AssumedSection(panel_tilt_deg=7.0, panel_turn_deg=11.0))
    assert np.degrees(np.arccos(wrong.normal @ spec.normal)) == pytest.approx(7.0, abs=1e-9)
    frame = np.stack([wrong.right, wrong.up, wrong.normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    turned = assumed_model.tell_panel(spec, AssumedSection(panel_turn_deg=11.0))
    assert np.degrees(np.arccos(turned.up @ spec.up)) == pytest.approx(11.0, abs=1e-9)


def test_a_leaning_body_hears_from_where_its_array_looks(room):
    """Arrivals from the vertices of the paths, turned by scipy's rotations into the array's own frame."""
    spec = load_spec(PIPELINE, ["channel=image_source", "cycles=3", "told.tilt_deg=4.0"])
    setup = prepare_setup(room, spec, rng=np.random.default_rng(1))
    motion = setup.scene.agent
    heard = assumed_model.perceived_paths(setup.paths, motion, spec.told, rng=np.random.default_rng(2))
    level = setup.paths.arrival
    for cycle in range(3):
        # the front rises by 4 degrees: about y in the right-handed sense it would sink
        body = Rotation.from_euler("ZY", [motion.heading[cycle], -np.radians(4.0)])
        rx = motion.position[cycle] + body.apply(np.array(setup.body.rx_offset))
        np.testing.assert_allclose(motion.rx[cycle], rx, atol=1e-12)
        for path in np.flatnonzero(setup.paths.valid[cycle] & (setup.paths.kind != PathKind.LOS)):
            last = setup.paths.vertices[cycle, path, setup.paths.num_vertices[path] - 1]
            own = body.inv().apply((last - rx) / np.linalg.norm(last - rx))
            seen = Rotation.from_euler("Z", motion.heading[cycle]).inv().apply(np.array(heard.arrival[cycle, path]))
            np.testing.assert_allclose(seen, own, atol=1e-9)
    assert np.abs(heard.arrival - level).max() > 0.05


def test_a_clock_of_its_own_shifts_and_drifts(room):
    spec = load_spec(
        PIPELINE, ["channel=image_source", "cycles=5", "told.clock_offset_ns=2.0", "told.clock_drift_ns_s=3.0"]
    )
    setup = prepare_setup(room, spec, rng=np.random.default_rng(1))
    late = (
        assumed_model.perceived_paths(setup.paths, setup.scene.agent, spec.told, rng=np.random.default_rng(2)).tau
        - setup.paths.tau
    )
    expected = 1e-9 * (2.0 + 3.0 * 0.1 * np.arange(5))[:, None] * setup.paths.valid
    np.testing.assert_allclose(late, expected, rtol=0.0, atol=1e-22)  # float64 of delays below 1e-7 s
