"""Returns of walls that come in too near to others for the bandwidth are named, with a bandwidth that parts them."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.link_budget import Survey, survey
from rislam_rt.adviser.return_warnings import lone_share, merged_return_warnings, return_warnings
from rislam_rt.measurement import measure, path_std
from rislam_rt.model import PathKind
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
NARROW = "radio.bandwidth_ghz=0.05"
"""1 / B is 6 m of path, in a room of 7 m."""


@cache
def looked(*changed: str, room: str = "two_scatterers") -> Survey:
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))
    return survey(load_scene(ROOT / "scenes" / room), settings, places=5)


def lines(found: Survey) -> list[str]:
    return [finding.line for finding in merged_return_warnings(found, "scene.toml")]


def at(gigahertz: float) -> Survey:
    """The survey of the narrow band, under another bandwidth: the paths are the same."""
    found = looked(NARROW)
    radio = replace(found.settings.radio, bandwidth=1e9 * gigahertz)
    return found._replace(settings=found.settings._replace(radio=radio))


def test_a_bandwidth_that_parts_few_returns_is_named_with_the_least_of_one_digit_that_parts_most() -> None:
    (line,) = lines(looked(NARROW))
    assert line.startswith(
        "scene.toml: radio.bandwidth_ghz: of the walls' returns loud enough to be heard along the way"
    )
    assert "(1 / B is 6 m of path)" in line
    told = re.search(r"only (\d+)% come in alone.* give radio.bandwidth_ghz = (0\.0\d), from which on most", line)
    assert told is not None
    assert float(told.group(1)) == pytest.approx(100.0 * lone_share(at(0.05), at(0.05).settings), abs=0.5)
    enough = float(told.group(2))
    assert not lines(at(enough))
    assert lines(at(enough - 0.01))


@pytest.mark.parametrize("room", ["two_scatterers", "paper_room", "office"])
def test_rooms_as_they_come_are_not_warned_of(room: str) -> None:
    assert not lines(looked(room=room))


def test_the_receivers_own_samples_agree() -> None:
    """Single returns found where they are, within five deviations of a lone path: nearly all where nearly all come in
    alone, and few where few do."""
    for changed, lone in ((), True), ((NARROW,), False):
        found = looked("receiver.alternation=false", *changed)
        settings, paths = found.settings, found.paths
        single = np.sum(paths.tx_walls >= 0, axis=1) + np.sum(paths.rx_walls >= 0, axis=1) == 1
        loud = audible_paths(paths, settings, use_vt=True) & single & (paths.kind == PathKind.VT)
        right = []
        for cycle, heading in enumerate(found.scene.agent.heading):
            rng = np.random.default_rng(cycle)
            heard, truth = measure(paths, cycle, float(heading), settings.radio, settings.receiver, rng=rng)
            for path in np.flatnonzero(loud[cycle]):
                std, _ = path_std(settings.radio.integrated_snr(paths.gain[cycle, [path]]), settings.radio)
                away = np.abs(heard.tau[truth.path == path] - paths.tau[cycle, path])
                right.append(bool((away < 5.0 * std).any()))
        assert (np.mean(right) > 0.9) == (lone_share(found, settings) > 0.9) == lone
        assert (np.mean(right) < 0.5) == (lone_share(found, settings) < 0.5) == (not lone)


def test_what_cannot_merge_comes_in_alone_and_what_cannot_be_parted_never_does() -> None:
    """The limits: a receiver that is told to merge nothing, and one antenna with a band of a megahertz."""
    apart = looked(NARROW, "receiver.estimator=bound", "receiver.merge=false")
    assert lone_share(apart, apart.settings) == 1.0
    one = ("radio.array.rows=1", "radio.array.cols=1", "radio.bandwidth_ghz=0.001")
    for bound in ((), ("receiver.estimator=bound",)):
        together = looked(*one, *bound)
        assert lone_share(together, together.settings) == 0.0


def test_who_throws_wall_returns_away_is_not_warned() -> None:
    found = looked(NARROW, "slam.use_vt=false")
    assert len(lines(found)) == 1
    assert [*return_warnings(found, "scene.toml")] == []
