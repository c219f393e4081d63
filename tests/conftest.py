"""What every process that tests does once."""

import gc
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import pytest


@pytest.fixture(scope="session", autouse=True)
def no_waiting_for_the_disk() -> Iterator[None]:
    """Files are written as ever, but nobody waits until the disk has them: no test cuts the power."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@contextmanager
def _cells_here(jobs: int, limit: float | None) -> Iterator[Callable[[Iterable[tuple[str, Any]]], Iterator[Any]]]:
    from rislam_rt.sweeps.cell_work import attempt

    yield lambda tasks: ((name, attempt(task)) for name, task in tasks)


@pytest.fixture(scope="session")
def cells_here() -> Callable[[], AbstractContextManager[None]]:
    """A context in which sweeps run their cells in this process: a worker, which other tests start, loads the package
    anew for half a second."""
    from rislam_rt.sweeps import run as sweep_run

    @contextmanager
    def here() -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sweep_run, "local_pool", _cells_here)
            yield

    return here


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made and saved, and their canvas stays blank: for who asks whether a file is there, of a figure that
    another test draws."""
    from matplotlib.figure import Figure

    monkeypatch.setattr(Figure, "draw", lambda *_: None)


def _is_whole(config: pytest.Config) -> bool:
    """Whether all tests are asked for, in no order of the caller's."""
    return config.args_source is config.ArgsSource.TESTPATHS


def pytest_configure(config: pytest.Config) -> None:
    """The second process loads the tests from the end: what is not compiled yet, two need not compile twice."""
    if _is_whole(config) and getattr(config, "workerinput", {}).get("workerid") == "gw1":
        tests = config.rootpath / "tests"
        config.args = [
            str(tests / top) for top in sorted({p.relative_to(tests).parts[0] for p in tests.rglob("test_*.py")})
        ]
        config.args.reverse()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Every process has them in the same order."""
    if _is_whole(config):
        items.sort(key=lambda item: item.path)


def pytest_collection_finish() -> None:
    """What is loaded by now stays to the end: the collector of garbage is not to go through it again and again, and
    seldom through what is new."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 50)
