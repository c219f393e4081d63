"""The run: repeatable, fair between schemes, resumable, and strict about what does not fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind
from rislam_rt.pipeline import cycle, load_spec
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.recordings.replay import Recorder
from rislam_rt.pipeline.run import check_run, prepare_setup, run_scheme
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.progress import tell_nobody

PIPELINE = Path(__file__).parents[2] / "pipelines" / "trace_then_slam.toml"


def test_other_seed_other_noise(short_result, run_short):
    other = run_short('schemes=["random"]', seed=8)
    assert (other.schemes["random"].position != short_result.schemes["random"].position).any()


def test_a_scheme_does_not_depend_on_the_others(short_result, run_short):
    alone = run_short('schemes=["random"]').schemes["random"]
    np.testing.assert_array_equal(alone.position, short_result.schemes["random"].position)
    np.testing.assert_array_equal(alone.applied, short_result.schemes["random"].applied)


def test_what_schemes_hear_under_the_same_codes_is_found_once(run_short, monkeypatch):
    calls, measure = [], cycle.measure
    monkeypatch.setattr(cycle, "measure", lambda *given, **more: calls.append(1) or measure(*given, **more))
    alone = run_short('schemes=["channel_slam"]', "cycles=4").schemes["channel_slam"]
    count = len(calls)
    both = run_short('schemes=["random", "channel_slam"]', "cycles=4").schemes
    assert len(calls) == 2 * count
    np.testing.assert_array_equal(both["channel_slam"].position, alone.position)
    np.testing.assert_array_equal(both["channel_slam"].component_path, both["random"].component_path)
    run_short('schemes=["random", "no_ris", "exact"]', "design.method=exact", "cycles=4")
    assert len(calls) == 5 * count


def test_gains_are_those_of_the_applied_code(room, short_result):
    from rislam_rt.channel.image_source import ImageSourceChannel
    from rislam_rt.model import RisCode
    from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings

    radio = build_settings(PipelineSpec.model_validate(short_result.config)).radio
    channel = ImageSourceChannel(replace(room, agent=room.agent[:8]), radio, 2)
    scheme = short_result.schemes["random"]
    expected = channel.respond(channel.paths(channel.scene.agent), RisCode(scheme.applied, scheme.levels))
    np.testing.assert_allclose(scheme.gain, expected.gain, rtol=1e-12)


def test_without_panel_only_panel_paths_go(short_result):
    plain = without_panel(short_result.paths)
    panel = np.isin(plain.kind, (PathKind.RIS, PathKind.VRIS))
    assert panel.any()
    assert not plain.valid[:, panel].any()
    np.testing.assert_array_equal(plain.valid[:, ~panel], short_result.paths.valid[:, ~panel])


def test_references_run(run_short):
    result = run_short('schemes=["no_ris", "exact", "genie"]', "cycles=3", "design.method=exact")
    assert result.schemes["no_ris"].applied.shape == (3, 0, 0)
    direct = result.paths.kind == PathKind.RIS
    # The genie knows the direct path itself: the exact optimum of its gain is above that of any other code.
    genie, exact = (np.abs(result.schemes[name].gain[:, direct]) for name in ("genie", "exact"))
    assert (genie > exact).all()
    assert not result.schemes["no_ris"].gain[:, direct].any()


def test_completed_schemes_are_not_run_again(short_result, run_short):
    done, stages = {"random": short_result.schemes["random"]}, []
    result = run_short(done=done, progress=lambda setup, at, total: stages.append(setup))
    assert set(stages) == {"trace", "optimized"}
    assert result.schemes["random"] is short_result.schemes["random"]
    assert list(done) == ["random", "optimized"]
    np.testing.assert_array_equal(result.schemes["optimized"].position, short_result.schemes["optimized"].position)


def test_progress_counts_to_the_end(run_short):
    news = []
    run_short('schemes=["random"]', "cycles=4", progress=lambda *item: news.append(item))
    assert news == [("trace", 0, 1), ("trace", 1, 1), *[("random", k, 4) for k in range(5)]]


def test_lost_and_late_codes_run(run_short):
    result = run_short('schemes=["random"]', "control.delay_cycles=2", "control.loss_probability=0.5")
    scheme = result.schemes["random"]
    assert not scheme.applied[:2].any()
    assert scheme.sent[:2].any()


@pytest.mark.parametrize(
    ("override", "field"),
    [("cycles=601", "cycles: 601"), ("budget.measure_s=0.5", "budget"), ("control.levels=3", "control.levels")],
)
def test_what_does_not_fit_is_refused(room, override, field):
    spec = load_spec(PIPELINE, [override])
    with pytest.raises(ConfigError, match=field):
        check_run(room, spec)


def test_a_scheme_with_a_panel_needs_one(room, short_spec):
    with pytest.raises(ConfigError, match="needs a panel"):
        check_run(replace(room, ris=None), short_spec)


def test_codes_alternate_where_there_is_a_panel(room, run_short):
    """A component says whether it ran over the panel under codes that alternate, and of held ones nobody knows."""

    def told(name, scene, *keys):
        spec = load_spec(PIPELINE, ["channel=image_source", "cycles=2", f'schemes=["{name}"]', *keys])
        recorder, setup = Recorder(ESTIMATORS["slam"]), prepare_setup(scene, spec, rng=np.random.default_rng(7))
        run_scheme(name, setup, spec, tell_nobody, recorder.estimator)
        return {one.from_panel is not None for one in recorder.inputs.measurements}

    assert told("random", room) == {True}
    assert told("random", room, "receiver.alternation=false") == {False}
    assert told("no_ris", room) == told("no_ris", replace(room, ris=None)) == {False}


def test_a_panel_without_half_a_turn_holds_its_code(room):
    odd = ["room.panel_levels=3"]
    with pytest.raises(ConfigError, match=r"ris\.levels: 3 received; .* or receiver\.alternation = false"):
        check_run(room, load_spec(PIPELINE, odd))
    check_run(room, load_spec(PIPELINE, [*odd, "receiver.alternation=false"]))
    check_run(room, load_spec(PIPELINE, [*odd, 'schemes=["no_ris"]']))


def test_room_without_panel_runs(room, run_short):
    result = run_short('schemes=["no_ris"]', "cycles=3", scene=replace(room, ris=None))
    assert not np.isin(result.paths.kind, (PathKind.RIS, PathKind.VRIS)).any()


def test_uneven_stamps_from_the_epoch_run_as_even_ones_do(room, run_short, short_result):
    """A clock that is 2 ms off at every stamp, 50 years on: the same errors but for where the agent is meanwhile."""
    agent, rng = room.agent[:8], np.random.default_rng(2)
    stamps = agent.time + rng.uniform(-0.002, 0.002, 8) * (np.arange(8) > 0)
    place = agent.position[0] + stamps[:, None] * agent.velocity
    moved = replace(room, agent=replace(agent, time=1.7e9 + stamps, position=place))
    uneven = run_short('schemes=["random"]', scene=moved)
    first, second = short_result.schemes["random"].position - agent.position, uneven.schemes["random"].position - place
    assert np.abs(first - second).max() < 0.005
    np.testing.assert_allclose(uneven.scene.agent.elapsed, stamps, rtol=0, atol=3e-7)


def test_same_seed_same_bits_in_two_processes(run_short, short_result):
    again = run_short(jobs=2)
    for name, scheme in short_result.schemes.items():
        for field in ("position", "covariance", "applied", "gain", "component_path", "component_landmark"):
            np.testing.assert_array_equal(getattr(again.schemes[name], field), getattr(scheme, field))
