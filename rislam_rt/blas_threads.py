"""One thread of linear algebra: the matrices are small, and sums in one order give the same bits on every machine."""

import sys
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Told = ParamSpec("Told")
Found = TypeVar("Found")


def in_one_blas_thread(function: Callable[Told, Found]) -> Callable[Told, Found]:
    """The function, run with one thread of numpy's and scipy's linear algebra, and as many as before afterwards.

    Two threads of OpenBLAS make the filter four times slower. The command line asks for one before numpy is loaded; who
    calls from Python has loaded it already.
    """

    @wraps(function)
    def limited(*args: Told.args, **kwargs: Told.kwargs) -> Found:
        with _libraries(len(sys.modules)).limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries of linear algebra that are loaded, looked for again once there are more modules: they come with
    one."""
    return ThreadpoolController()
