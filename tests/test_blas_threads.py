"""Who calls from Python has one thread of linear algebra for as long as a run takes, and its own number afterwards."""

import inspect

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import rislam_rt
from rislam_rt.blas_threads import in_one_blas_thread


def threads():
    """Numbers of threads of all libraries of linear algebra that are loaded."""
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@in_one_blas_thread
def _seen(told, *, fails=False):
    if fails:
        raise ValueError(told)
    return told, threads()


def test_a_run_has_one_thread_and_leaves_the_others_as_they_were():
    np.linalg.inv(np.eye(3))
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert _seen("told") == ("told", {1})
        assert threads() == before
        with pytest.raises(ValueError, match="told"):
            _seen("told", fails=True)
        assert threads() == before


@pytest.mark.parametrize("name", ["run_slam", "replay", "localise"])
def test_what_runs_an_estimator_does_so_in_one_thread(name):
    function = getattr(rislam_rt, name)
    source = inspect.getsource(function)
    assert source.startswith("@in_one_blas_thread\n")
    assert inspect.signature(function) == inspect.signature(inspect.unwrap(function))
