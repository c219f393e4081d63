"""Work side by side: the same results, news on the way, and no silence when a process dies."""

import os
import sys
from importlib import import_module

import pytest

from rislam_rt.errors import RislamError, TraceError
from rislam_rt.worker_pool import run_side_by_side


def square(name, offset, tell):
    tell(name, 1, 1)
    return int(name) ** 2 + offset


def fail(name, tell):
    if name == "bad":
        raise TraceError("no path; move the agent")
    return name


def die(name, tell):
    if name == "a":
        os._exit(11)
    return name


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_piece_is_done_once_and_heard_of(jobs):
    news = []
    found = dict(run_side_by_side(square, ["1", "2", "3"], (10,), jobs, lambda *item: news.append(item)))
    assert found == {"1": 11, "2": 14, "3": 19}
    assert sorted(news) == [("1", 1, 1), ("2", 1, 1), ("3", 1, 1)]


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_failure_is_a_result_and_the_rest_goes_on(jobs):
    found = dict(run_side_by_side(fail, ["bad", "good"], (), jobs, print))
    assert isinstance(found["bad"], TraceError)
    assert str(found["bad"]) == "no path; move the agent"
    assert found["good"] == "good"


def test_a_dead_process_is_told():
    found = dict(run_side_by_side(die, ["a", "b"], (), 2, print))
    assert found["b"] == "b"
    assert isinstance(found["a"], RislamError)
    assert "exit code 11" in str(found["a"])


def place(name, tell):
    return import_module(name).PLACE


def test_a_worker_finds_the_modules_that_this_process_finds(tmp_path, monkeypatch):
    """Not those of the working folder, which may have a file of the same name, or of one of Python's own."""
    for folder in ("working", "named"):
        (tmp_path / folder).mkdir()
        for name in ("of_two_folders", "of_both"):
            (tmp_path / folder / f"{name}.py").write_text(f"PLACE = '{folder}'\n")
    (tmp_path / "working" / "random.py").write_text("PLACE = 'no library'\n")
    monkeypatch.chdir(tmp_path / "working")
    monkeypatch.setattr(sys, "path", [one for one in sys.path if one] + [str(tmp_path / "named")])
    found = dict(run_side_by_side(place, ["of_two_folders", "of_both"], (), 2, print))
    assert found == {"of_two_folders": "named", "of_both": "named"}
