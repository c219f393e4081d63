"""Why a run was lost: counted once a time, over slices and silence, and said in plain words."""

from rislam_rt.pipeline.scores.loss_causes import WORDS, LossTally, words_of_loss
from rislam_rt.slam.step_info import LossCause

OUTCOMES = ["ok", "diverged", "no measurements", "diverged", "ok", "diverged", "diverged", "ok", "diverged"]
CAUSES = [0, LossCause.TRACKS, 0, LossCause.RESTART, 0, LossCause.MAP, LossCause.MOTION, 0, LossCause.MAP]


def test_a_time_of_loss_counts_once_by_what_began_it() -> None:
    """Silence ends none, nor does the end of a slice."""
    whole, parts = LossTally(), LossTally()
    whole.add(range(10, 19), OUTCOMES, CAUSES)
    for cut in (slice(0, 3), slice(3, 6), slice(6, 9)):
        parts.add([*range(10, 19)][cut], OUTCOMES[cut], CAUSES[cut])
    expected = {"times": 3, "first_s": 1.0, "causes": {"map": 2, "tracks": 1}}
    assert whole.scores(10.0) == parts.scores(10.0) == expected
    assert words_of_loss(expected) == f"{WORDS[LossCause.MAP]} (2 times); {WORDS[LossCause.TRACKS]}"


def test_an_estimator_without_reasons_is_counted_too() -> None:
    tally = LossTally()
    tally.add([0.0, 0.1], ["ok", "diverged"], None)
    assert tally.scores(0.0) == {"times": 1, "first_s": 0.1, "causes": {"none": 1}}
    assert words_of_loss(tally.scores(0.0)) == "it gives no reason"
    assert LossTally().scores(0.0) == {"times": 0, "first_s": None, "causes": {}}
    assert set(WORDS) == set(LossCause)
