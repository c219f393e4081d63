"""The verdict on a run: the right numbers in sentences, and the right reason for what is missing."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.pipeline.scores.summary import landmark_scores, summarise
from rislam_rt.report.conclusions import judge_run, panel_found_at, why_not
from rislam_rt.report.page import build_page
from rislam_rt.report.terminal_tables import summary_rows


def test_the_page_begins_with_the_error_of_every_scheme(result):
    summary = summarise(result)
    said = judge_run(result, summary)
    for name, words in (("random", "random codes"), ("no_ris", "no panel")):
        assert f"{100 * summary['schemes'][name]['rmse_m']:.2g} cm with {words}" in said.headline
    assert "panel not found" in said.schemes["random"]
    assert "panel" not in said.schemes["no_ris"].removeprefix("no panel")
    page = build_page(result, summary, {"room": b""})
    assert page.index(said.headline) < page.index("<img") < page.index("<table")


def test_a_lost_scheme_is_named(result):
    summary = summarise(result)
    summary["schemes"]["random"]["diverged"] = True
    assert judge_run(result, summary).headline.endswith("diverged with random codes.")


def test_a_scheme_that_was_silently_lost_by_less_than_half_a_metre_is_named_and_says_so(result):
    summary = summarise(result)
    silent = {"lost": True, "silent": True, "lost_at_s": 7.7}
    summary["schemes"]["random"] |= {"true_loss": silent, "largest_m": 0.25}
    said = judge_run(result, summary)
    assert said.headline.endswith("; lost with random codes.")
    assert said.lost["random"][0].startswith("silently lost from 7.7 s on")
    summary["schemes"]["random"]["true_loss"] = silent | {"silent": False}
    assert judge_run(result, summary).lost["random"] == []


def test_why_a_scheme_is_lost_is_said(result):
    summary = summarise(result)
    scores = summary["schemes"]["random"]
    scores["lost"] = {"times": 3, "first_s": 1.25, "causes": {"motion": 2, "jump": 1}}
    scores["outcomes"] = {"ok": 4, "no measurements": 2}
    said = judge_run(result, summary).lost
    assert said["no_ris"] == []
    assert said["random"][0] == "nothing was heard in 2 of 6 cycles"
    assert said["random"][1].startswith(
        "held itself for lost 3 times, first after 1.2 s: the lengths of the paths change"
    )
    assert said["random"][1].endswith("(2 times); what it hears fits its map from another place")
    scores["lost"], scores["outcomes"], scores["diverged"] = (
        {"times": 0, "first_s": None, "causes": {}},
        {"ok": 6},
        True,
    )
    assert judge_run(result, summary).lost["random"][0].startswith("diverged without noticing")


def test_the_panel_is_found_from_when_it_stays(result):
    scheme, centre = result.schemes["random"], result.scene.ris.center
    held = np.array([[False], [True], [False], [True], [True], [True]])
    place = np.broadcast_to(centre, (6, 1, 3))

    def known(probability):
        return replace(scheme, ident=[0], parent=[-1], held=held, landmark_position=place, ris_probability=probability)

    assert panel_found_at(result, known(np.full((6, 1), 0.9))) == pytest.approx(0.3)
    assert panel_found_at(result, known(np.array([[0.9], [0.9], [0.9], [0.9], [0.1], [0.9]]))) == pytest.approx(0.5)
    assert panel_found_at(result, known(np.full((6, 1), 0.1))) is None


def test_the_panel_is_found_though_a_ghost_lies_nearer_to_it(result):
    """As in a stranger's lift: column 0 is a ghost at the very place, column 1 the landmark held for the panel."""
    scheme, centre = result.schemes["random"], result.scene.ris.center
    place = np.tile(centre + np.array([[0.0, 0.0, 0.0], [0.016, 0.0, 0.0]]), (6, 1, 1))
    probability = np.tile([1e-9, 1.0], (6, 1))
    both = {"ident": [3, 5], "parent": [-1, -1], "held": np.ones((6, 2), dtype=bool)}
    there = replace(scheme, **both, landmark_position=place, ris_probability=probability)
    assert panel_found_at(result, there) == 0.0
    entry = landmark_scores(result.scene, there)["ris"]
    assert entry["final_m"] == pytest.approx(0.016)
    assert (entry["cycles_identified"], entry["identified_last"], entry["identified_from_s"]) == (6, True, 0.0)
    away = replace(there, landmark_position=place + np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    assert panel_found_at(result, away) is None
    off = {**result.schemes, "random": replace(away, outcome=scheme.outcome)}
    summary = summarise(replace(result, schemes=off))
    unfound = summary["schemes"]["random"]["landmarks"]["ris"]
    assert (unfound["identified_last"], unfound["identified_from_s"]) == (False, None)
    said = judge_run(replace(result, schemes=off), summary)
    assert "panel not found" in said.schemes["random"]
    assert "ris: a landmark lies there, which the map does not take for the panel" in said.missing["random"]
    assert ["panel found", "no", "-"] in summary_rows(summary)


def test_the_panel_is_judged_in_the_frame_that_the_filter_was_given(result):
    """`score_run` takes the start's error out of the map before it asks for 1 m: so does the run."""
    scheme, scene = result.schemes["random"], result.scene
    one = {"ident": [5], "parent": [-1], "held": np.ones((6, 1), dtype=bool), "ris_probability": np.ones((6, 1))}
    off = np.array([0.6, 0.0, 0.0])
    there = replace(scheme, **one, landmark_position=np.tile(scene.ris.center + 2.0 * off, (6, 1, 1)))
    start = scene.agent.position[0]
    assert panel_found_at(result, replace(there, start_position=start)) is None
    assert panel_found_at(result, replace(there, start_position=start + off)) == 0.0


def test_paths_that_come_in_too_late_are_called_late(result):
    """Loud in all cycles, and one of them weak in the first, which is not the reason."""
    summary = summarise(result)
    scheme = result.schemes["random"]
    summary["schemes"]["random"]["landmarks"]["sphere"]["final_m"] = None
    tau, gain = result.paths.tau + 200e-9, scheme.gain.copy()
    gain[0] *= 1e-3
    late = replace(
        result, paths=replace(result.paths, tau=tau), schemes={**result.schemes, "random": replace(scheme, gain=gain)}
    )
    (said,) = (line for line in judge_run(late, summary).missing["random"] if line.startswith("sphere"))
    assert "later than receiver.max_delay, 80 ns" in said
    assert "below the threshold" not in said


@pytest.mark.parametrize(
    ("snr", "valid", "said"),
    [
        (np.zeros((4, 0)), np.zeros((4, 0), dtype=bool), "no path reaches the agent"),
        (np.full((4, 1), 4.0), np.ones((4, 1), dtype=bool), "4 dB below the threshold"),
        (np.array([[40.0]] + 99 * [[1.0]]), np.ones((100, 1), dtype=bool), "heard in 1.0 % of the cycles only"),
        (np.full((4, 2), 40.0), np.ones((4, 2), dtype=bool), "heard in 100 % of the cycles"),
    ],
)
def test_why_something_is_missing(snr, valid, said):
    assert said in why_not(snr, valid, 10.0)


def test_what_comes_from_below_the_array_is_not_called_heard(result):
    """The scatterer, of which the map holds nothing, as it is and turned upside down in the last four of six cycles."""
    summary = summarise(result)
    summary["schemes"]["random"]["landmarks"]["sphere"]["final_m"] = None

    def said(cycles):
        arrival = result.paths.arrival.copy()
        arrival[cycles, :, 2] = -np.abs(arrival[cycles, :, 2]) - 1e-3
        turned = replace(result, paths=replace(result.paths, arrival=arrival))
        return " ".join(judge_run(turned, summary).missing["random"])

    assert "heard in 100 %" in said(np.s_[:0])
    assert "heard in 33 %" in said(np.s_[2:])


def test_a_scheme_that_ends_a_metre_away_is_called_lost(result):
    scheme = result.schemes["random"]
    astray = replace(scheme, position=scheme.position + np.linspace(0.0, 1.0, 6)[:, None] * [0.0, 1.0, 0.0])
    both = replace(result, schemes={**result.schemes, "random": astray})
    assert judge_run(both, summarise(both)).headline.endswith("diverged with random codes.")
    assert "diverged" not in judge_run(result, summarise(result)).headline


def test_a_run_that_only_its_start_puts_at_the_bound_is_not_called_so(result):
    """37 times the bound relative to its start: most of the absolute error and of its bound are the start's."""
    summary = summarise(result)
    errors = {"rmse_m": 0.013, "bound_m": 0.0128, "over_bound": 1.02, "relative_bound_m": 0.0002}
    for relative, words in ((0.0075, "1.3 cm; 0.75 cm relative to its start, 37.5 times the bound;"),
                            (0.0003, "1.3 cm; 0.03 cm relative to its start, 1.5 times the bound;"),
                            (None, "1.3 cm, at the bound;")):  # fmt: skip
        for scores in summary["schemes"].values():
            scores |= {**errors, "relative_rmse_m": relative}
        said = judge_run(result, summary)
        assert said.schemes["random"].startswith(f"random codes: {words}")
        assert ("relative to its start by" in said.headline) == (relative is not None)
    assert "at the bound" not in said.headline
