"""The verdict on a run: the right numbers in sentences, and the right reason for what is missing."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.report.conclusions import judge_run, panel_found_at, why_not
from rislam_rt.report.page import build_page


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
