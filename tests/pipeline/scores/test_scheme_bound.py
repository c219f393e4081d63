"""The bound that a run is held against: the benchmark's own figures, what may lower it, and what must not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ncx2

from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.information import MotionPrior, assumed_std, build_landmark_model, heard_paths, posterior_bound
from rislam_rt.information.priors import FLOOR_TILT, UPRIGHT_TILT
from rislam_rt.model import MapEstimate, PathKind, empty_map
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.pipeline.scores.posterior_bound import over_distortion, scheme_bound
from rislam_rt.pipeline.scores.summary import map_score, summarise
from rislam_rt.pipeline.specification.pipeline_spec import build_settings

PIPELINE = Path(__file__).parents[3] / "pipelines" / "trace_then_slam.toml"
SHORT = ["channel=image_source", "cycles=40", "depth=1"]
SEEN = "radio.reference_snr_db=60.0"
"""At which even a panel at level 0 throughout is heard."""


@pytest.fixture(scope="module")
def setup(room):
    return prepare_setup(room, load_spec(PIPELINE, SHORT), rng=np.random.default_rng(1))


def bound(setup, scheme, *settings, gain=None):
    config = load_spec(PIPELINE, [*SHORT, *settings]).model_dump(mode="json")
    return scheme_bound(setup.scene, setup.paths, setup.paths.gain if gain is None else gain, scheme, config).agent


def test_it_is_the_recursion_over_all_paths_times_their_detection_probability(setup):
    """The same without dropping columns or rows, the probability from the noncentral chi-square law itself."""
    settings = build_settings(load_spec(PIPELINE, SHORT))
    walls, motion = build_walls(setup.scene), setup.scene.agent
    snr = settings.radio.integrated_snr(setup.paths.gain)
    reported = (setup.paths.arrival[..., 2] >= 0.0) & (setup.paths.tau <= settings.receiver.max_delay)
    gain = np.where(reported, setup.paths.gain * np.sqrt(ncx2.sf(20.0, 2, 2.0 * snr)), 0.0)
    model = build_landmark_model(
        setup.paths.with_gain(gain), motion, setup.scene.landmark_positions, walls.normal, walls.offset, settings.radio
    )
    beforehand = assumed_std(model, float(setup.scene.agent.position[:, 2].min()), upright=False)
    expected = posterior_bound(model.rows(1e-6), motion.time, MotionPrior(), beforehand).rms
    # the table of probabilities has steps of 0.1 dB, and paths of less than 1e-3 in SNR are left out
    np.testing.assert_allclose(bound(setup, "random", "slam.use_vt=false"), expected, rtol=2e-3)


def test_a_path_below_the_threshold_counts_for_something(setup):
    """Noise lifts it over the threshold now and then: no step at 10 dB."""
    values = [bound(setup, "random", f"radio.reference_snr_db={snr}")[-1] for snr in np.arange(2.0, 6.0, 0.5)]
    ratio = np.array(values[1:]) / values[:-1]
    assert (ratio < 1.0).all()
    assert ratio.min() > 0.8


def test_without_signals_it_is_the_start_carried_on(setup):
    """No path is heard: variance `s_x^2 + t^2 s_v^2` an axis and the noise of the motion, which adds to it."""
    found = bound(setup, "random", "radio.reference_snr_db=-200.0", "slam.sigma_a=1e-9")
    time = setup.scene.agent.time
    np.testing.assert_allclose(found, np.sqrt(2.0) * 0.01 * np.hypot(1.0, time), rtol=1e-6)


@pytest.mark.parametrize("sigma", [0.02, 0.5])
def test_without_signals_it_grows_as_the_agent_may_accelerate(setup, sigma):
    """White acceleration that is constant over a step moves the place by dt^2 / 2 then, and by dt a second later."""
    found = bound(setup, "random", "radio.reference_snr_db=-200.0", f"slam.sigma_a={sigma}")
    time = setup.scene.agent.time
    step = np.diff(time)
    moved = [np.sum((step[:k] ** 2 / 2.0 + step[:k] * (time[k] - time[1 : k + 1])) ** 2) for k in range(len(time))]
    expected = np.sqrt(2.0 * (0.01**2 * (1.0 + time**2) + sigma**2 * np.array(moved)))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_less_noise_and_more_signals_lower_it(setup):
    loud, quiet = (bound(setup, "random", f"radio.reference_snr_db={snr}")[-1] for snr in (30.0, 0.0))
    assert loud < quiet
    plain = without_panel(setup.paths).gain
    assert bound(setup, "random", SEEN)[-1] < bound(setup, "no_ris", SEEN, gain=plain)[-1]


def test_designed_codes_halve_what_can_be_known_of_the_panel_at_least(beside_panel):
    """The panel's own bound at 0 dB, over the start's error that moves the whole map: 0.01 m an axis.

    Information grows with power. In the last third of the run designed codes give the direct path 15 dB more than
    random ones do on average; a quarter of the variance (6 dB) has a margin for the time before the panel is known.
    """
    own = {name: s["landmarks"]["ris"]["bound_m"] for name, s in summarise(beside_panel)["schemes"].items()}
    over_start = {name: value**2 - 2.0 * 0.01**2 for name, value in own.items()}
    assert over_start["optimized"] < over_start["random"] / 4.0


def test_told_of_the_front_ends_faults_it_is_that_of_the_noise_they_make(setup):
    """Between the bounds at the least and at the largest distortion of any cycle; untold, as with an ideal one."""
    fault = ('receiver.estimator="waveform"', "hardware.phase_std_deg=1.0")
    ideal, untold = bound(setup, "random"), bound(setup, "random", *fault)
    told = bound(setup, "random", *fault, "hardware.told=true")
    assert (untold == ideal).all()
    assert (bound(setup, "random", *fault, "hardware.told=true", "hardware.calibration_cycles=5") == ideal).all()
    noise = build_settings(load_spec(PIPELINE, SHORT)).radio.noise_psd
    lit = over_distortion(setup.paths, build_settings(load_spec(PIPELINE, [*SHORT, *fault, "hardware.told=true"])))
    here = setup.paths.gain[:, 0] != 0.0
    rise = np.abs(setup.paths.gain[here, 0] / lit[here, 0]) ** 2
    low, high = (bound(setup, "random", f"radio.noise_psd={float(noise * r)!r}")[-1] for r in (rise.min(), rise.max()))
    assert ideal[-1] < low * (1.0 - 1e-9) < told[-1] < high * (1.0 + 1e-9)


def test_delays_alone_and_images_apart_know_less(setup):
    less, more = bound(setup, "bp_slam", SEEN), bound(setup, "random", SEEN)
    # covariances of 100 m^2 beforehand beside information of 1e8 / m^2: rounding leaves some 1e-6 of a value
    assert (less >= more * (1.0 - 1e-5)).all()
    assert less[-1] > more[-1]


def test_what_the_receiver_does_not_report_does_not_count(setup):
    settings = build_settings(load_spec(PIPELINE, [*SHORT, "receiver.max_delay=25e-9"]))
    heard = heard_paths(setup.paths, settings.sensor, use_vt=True)
    shown = heard.gain != 0.0
    assert 0 < shown.sum() < setup.paths.valid.sum()
    assert (heard.tau[shown] <= 25e-9).all()
    assert (heard.arrival[shown][:, 2] >= 0.0).all()
    assert (heard.kind != PathKind.LOS).all()
    assert (heard_paths(setup.paths, settings.sensor, use_vt=False).kind != PathKind.VT).all()


def test_what_the_filter_takes_for_granted_is_in_the_bound(setup):
    """A level floor always; walls upright with wall returns alone. Nothing of their direction, nor of the ceiling."""
    walls = build_walls(setup.scene)
    model = build_landmark_model(
        setup.paths, setup.scene.agent, setup.scene.landmark_positions, walls.normal, walls.offset,
        build_settings(load_spec(PIPELINE, SHORT)).radio,
    )  # fmt: skip
    for upright in (False, True):
        std = assumed_std(model, float(setup.scene.agent.position[:, 2].min()), upright=upright)
        tilts = {w: std[model.wall_column[n] + np.arange(2)] for n, w in enumerate(walls.names)}
        np.testing.assert_array_equal(tilts["floor"], FLOOR_TILT)
        np.testing.assert_array_equal(tilts["ceiling"], 0.5)
        for name in ("wall_x0", "wall_y0", "wall_x6", "wall_y6"):
            assert sorted(tilts[name]) == [UPRIGHT_TILT if upright else 0.5, 0.5]
            lean = plane_tangents(walls.normal[walls.names.index(name)])[int(np.argmin(tilts[name]))]
            assert not upright or abs(lean[2]) == 1.0


def test_landmarks_and_walls_have_bounds_where_they_are_heard(setup):
    """Louder is sharper; nothing heard, nothing known."""
    found = [
        scheme_bound(
            setup.scene, setup.paths, setup.paths.gain, "random",
            load_spec(PIPELINE, [*SHORT, f"radio.reference_snr_db={snr}"]).model_dump(mode="json"),
        )
        for snr in (60.0, 30.0, -200.0)
    ]  # fmt: skip
    loud, quiet, silent = found
    assert set(loud.landmarks) == set(setup.scene.landmarks)
    assert set(loud.walls) == set(build_walls(setup.scene).names)
    for name in set(loud.walls) & set(quiet.walls):
        assert loud.walls[name].angle < quiet.walls[name].angle
        assert loud.walls[name].distance < quiet.walls[name].distance
    assert all(loud.landmarks[name] < quiet.landmarks.get(name, np.inf) for name in loud.landmarks)
    assert (dict(silent.landmarks), dict(silent.walls)) == ({}, {})


def test_summary_holds_the_bound_and_the_map_score(short_result):
    for name, scheme in summarise(short_result)["schemes"].items():
        own = scheme_bound(
            short_result.scene, short_result.paths, short_result.schemes[name].gain, name, short_result.config
        ).agent
        assert scheme["bound_m"] == pytest.approx(np.sqrt(np.mean(own**2)))
        assert scheme["over_bound"] == pytest.approx(scheme["rmse_m"] / scheme["bound_m"])
        assert scheme["landmarks"]["ris"]["bound_m"] > 0.0
        assert set(scheme["map"]) == {"gospa_m", "localisation_m", "missed", "false"}


def test_map_score_counts_points_and_not_images(room, short_result):
    """Nothing was found in so short a run: each of two landmarks is missed and costs half the squared cut-off."""
    assert map_score(room, empty_map()) == {"gospa_m": 1.0, "localisation_m": 0.0, "missed": 2, "false": 0}
    points = np.vstack([room.landmark_positions + np.array([0.0, 0.3, 0.0]), [[9.0, 9.0, 9.0]]])
    found = MapEstimate(
        np.arange(3), points, np.zeros((3, 3, 3)), np.array([-1, -1, 0]), np.zeros(3), np.zeros(3),
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip
    assert map_score(room, found)["gospa_m"] == pytest.approx(np.sqrt(2 * 0.3**2))
    ghost = replace(found, parent=np.array([-1, -1, -1]))
    assert map_score(room, ghost)["false"] == 1
