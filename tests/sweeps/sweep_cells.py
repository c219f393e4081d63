"""Cheap cells for the tests of the sweep engine; workers import this module by name."""

import ctypes
import os
import sys
import time
from pathlib import Path


def draw(settings, seed):
    """A few numbers from the seed, some linear algebra (whose bits depend on the threads), and the clock apart."""
    import numpy as np

    time.sleep(settings.get("sleep", 0.0))
    x = np.random.default_rng(seed).standard_normal((60, 60))
    return {
        "offset": settings["x"] + settings["deep"]["y"],
        "norm": np.linalg.norm(x @ x @ x),
        "first": x[0, :3],
        "words": sorted({"b", "a", settings["word"]}, key=hash),
        "nan": float("nan"),
        "timing": {"now": time.time()},
    }


def misbehave(settings, seed):
    """One cell of each kind of trouble."""
    kind = settings["kind"]
    if kind == "abort":
        os.abort()
    if kind == "orphan":
        if os.fork() == 0:
            time.sleep(5.0)
            os._exit(0)
        os.abort()
    if kind == "segfault":
        ctypes.string_at(0)
    if kind == "leave":
        os._exit(0)
    if kind == "exit":
        sys.exit("gone")
    if kind == "hang":
        time.sleep(1e6)
    if kind == "raise":
        raise ValueError("no \udcff \u00e9\nsuch luck")
    if kind == "object":
        return {"x": object()}
    if kind == "list":
        return [1]
    if kind == "names":
        return {(1, 2): 3}
    print("a cell that talks")
    return {"ok": True}


def count(settings, seed):
    """Leave a mark each time that the cell runs; killed from outside the first time, if asked to be."""
    with Path(settings["marks"], str(settings["x"])).open("a") as file:
        file.write("x")
    if settings.get("blow") and Path(settings["marks"], str(settings["x"])).stat().st_size == 1:
        os.kill(os.getpid(), 9)
    return {"x": settings["x"]}


def slow_sweep(sleep=0.1):
    """Long enough to be killed in the middle; whoever does not kill it need not sleep [s] in every cell."""
    from rislam_rt.sweeps import Axis, Sweep

    axes = (Axis("x", tuple(range(10))), Axis("word", ("one", "two")))
    return Sweep("sweep_cells:draw", axes, {"deep": {"y": 1}}, paired=("word",), local={"sleep": sleep})


if __name__ == "__main__":
    # In a process of its own, for tests that kill it: FOLDER JOBS
    from rislam_rt.sweeps import SweepOptions, run_sweep

    folder, jobs = Path(sys.argv[1]), int(sys.argv[2])
    run_sweep(slow_sweep(), folder, SweepOptions(jobs=jobs), tell=lambda told: print(told.done, flush=True))
