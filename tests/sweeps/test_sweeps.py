"""The sweep engine: cells from parameters, one file each, the same bytes however the sweep was run and stopped."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import sweep_cells

from rislam_rt.errors import ConfigError, ResultError, SetupError
from rislam_rt.sweeps import Axis, Sweep, SweepOptions, build_cells, parse_axis, run_sweep
from rislam_rt.sweeps.run import estimate_cost
from rislam_rt.sweeps.store import read_timings

HERE = Path(__file__).parent
AXES = (Axis("x", (1, 2, 3)), Axis("word", ("one", "two")))
DRAW = Sweep("sweep_cells:draw", AXES, {"deep": {"y": 1}}, 2, paired=("word",))


def written(folder):
    """All that must be the same from every run."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != "timings.jsonl"]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A sweep that nothing disturbed, on one worker."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, run_sweep(DRAW, folder)


def test_cells_are_the_product_of_the_axes():
    cells = build_cells(DRAW)
    assert [(c.point["x"], c.point["word"], c.repetition) for c in cells[:4]] == [
        (1, "one", 0), (1, "one", 1), (1, "two", 0), (1, "two", 1),
    ]  # fmt: skip
    assert len({cell.ident for cell in cells}) == len(cells) == 12
    assert cells[0].settings == {"deep": {"y": 1}, "x": 1, "word": "one"}


def test_seeds_come_from_parameters_and_not_from_the_order():
    turned = Sweep(DRAW.function, (Axis("word", ("two", "one")), Axis("x", (3, 1, 2))), DRAW.base, 3, paired=("word",))
    there = {cell.ident: cell.seed for cell in build_cells(turned)}
    for cell in build_cells(DRAW):
        assert there[cell.ident] == cell.seed
    # a seed for each x and repetition, shared by the words, which are paired
    assert len({cell.seed for cell in build_cells(DRAW)}) == 6
    assert not {c.seed for c in build_cells(Sweep(DRAW.function, AXES, seed=1))} & set(there.values())


def test_a_sweep_that_grows_keeps_the_cells_that_it_has():
    """More values, between and before those that were there, and more repetitions."""
    there = {cell.ident: cell.seed for cell in build_cells(DRAW)}
    axes = (Axis("x", (0, 1, 2, 2.5, 3)), Axis("word", ("none", "one", "two")))
    grown = {cell.ident: cell.seed for cell in build_cells(Sweep(DRAW.function, axes, DRAW.base, 3, paired=("word",)))}
    assert len(grown) == 45
    assert there.items() <= grown.items()


def test_a_cell_is_another_if_what_it_depends_on_is():
    cells = [
        build_cells(Sweep(DRAW.function, AXES, DRAW.base, depends=lambda settings, d=d: {"room": d})) for d in "aab"
    ]
    assert cells[0] == cells[1]
    assert not {c.ident for c in cells[0]} & {c.ident for c in cells[2]}


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a=1,2", (1, 2)),
        ("a=1,2.5", (1.0, 2.5)),
        ("a.b=true,false", (True, False)),
        ("a=random,no_ris", ("random", "no_ris")),
        ('a="x,y",z', None),
        ('a=["p","q"],["r"]', (["p", "q"], ["r"])),
        ("a=-10,1e3", (-10.0, 1000.0)),
    ],
)
def test_axes_are_typed(text, values):
    if values is None:
        assert parse_axis('a="x,y","z"').values == ("x,y", "z")
        return
    axis = parse_axis(text)
    assert axis.values == values
    assert [type(v) for v in axis.values] == [type(v) for v in values]


@pytest.mark.parametrize("text", ["", "a", "=1", "a=", "a=1,,2", "a=1,x", "a=1,true", "a=nan", "a=1,1", "a..b=1"])
def test_bad_axis_is_one_line(text):
    with pytest.raises(ConfigError, match=r"^axis '[^\n]*$"):
        parse_axis(text)


@pytest.mark.parametrize(
    "change",
    [
        {"function": "nonsense"},
        {"function": "sweep_cells:nothing"},
        {"function": "no_such_module:f"},
        {"repetitions": 0},
        {"paired": ("z",)},
        {"axes": (Axis("a", (1,)), Axis("a.b", (1,)))},
        {"axes": (Axis("deep.y.z", (1,)),), "paired": ()},
        {"base": {"z": object()}},
    ],
)
def test_bad_sweep_is_one_line_and_leaves_nothing(change, tmp_path):
    fields = {"function": DRAW.function, "axes": AXES, "base": DRAW.base, **change}
    with pytest.raises(ConfigError, match=r"^[^\n]+; [^\n]+$|cannot be imported"):
        run_sweep(Sweep(**fields), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_results_come_back(whole):
    folder, report = whole
    assert not report.failed
    for row in report.rows:
        rng = np.random.default_rng(row.cell.seed)
        np.testing.assert_array_equal(row.result["first"], rng.standard_normal(3))
        assert row.result["offset"] == row.cell.point["x"] + 1
        assert row.result["nan"] is None
        assert "timing" not in row.result
        file = json.loads((folder / "cells" / f"{row.cell.ident}.json").read_text())
        assert file["result"] == row.result
        assert (file["seed"], file["settings"]["x"]) == (row.cell.seed, row.cell.point["x"])


def test_table_has_every_cell_in_order(whole):
    folder, report = whole
    with (folder / "table.csv").open() as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == ["x", "word", "repetition", "seed", "state", "message", "nan", "norm", "offset"]
    assert [float(row["norm"]) for row in table] == [row.result["norm"] for row in report.rows]
    assert [row["norm"] for row in json.loads((folder / "table.json").read_text())] == [
        row.result["norm"] for row in report.rows
    ]


def test_two_workers_give_the_same_bytes_and_tables_grow(whole, tmp_path):
    sizes, told = [], []
    run_sweep(
        DRAW, tmp_path, SweepOptions(jobs=2), tell=told.append,
        grow=lambda rows: sizes.append(sum(row.state == "done" for row in rows)),
    )  # fmt: skip
    assert written(tmp_path) == written(whole[0])
    assert sizes == sorted(set(sizes))  # and never the same twice
    assert (sizes[0], sizes[-1]) == (1, 12)
    assert [t.done for t in told] == [1, 1, *range(2, 13)]
    assert told[1].last is None  # the cost, after one cell and before the rest
    assert told[1].cost.cells == 11
    assert told[1].cost.seconds > 0.0
    assert told[-1].cost.seconds == 0.0


def test_a_worker_environment_does_not_leak(whole, tmp_path, monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    monkeypatch.setenv("PYTHONHASHSEED", "5")
    run_sweep(DRAW, tmp_path)
    assert written(tmp_path) == written(whole[0])
    assert os.environ["OPENBLAS_NUM_THREADS"] == "2"


def test_resumed_sweep_runs_what_is_missing(tmp_path):
    def sweep(*x):
        return Sweep("sweep_cells:count", (Axis("x", x),), local={"marks": str(marks)})

    marks, out = tmp_path / "marks", tmp_path / "out"
    marks.mkdir()
    run_sweep(sweep(1, 2), out)
    before = written(out)
    run_sweep(sweep(1, 2), out)
    assert written(out) == before
    report = run_sweep(sweep(1, 2, 3), out)
    torn, foreign = (out / "cells" / f"{row.cell.ident}.json" for row in report.rows[:2])
    torn.write_bytes(torn.read_bytes()[:40])
    foreign.write_bytes((out / "cells" / f"{report.rows[2].cell.ident}.json").read_bytes())
    (out / "cells" / ".rislam-rt-half_abc.tmp").write_text("{")
    (out / "cells" / ".half.json-abc").write_text("mine")
    run_sweep(sweep(1, 2, 3), out)
    assert {path.name: path.read_text() for path in marks.iterdir()} == {"1": "xx", "2": "xx", "3": "x"}
    assert [path.name for path in out.rglob(".*")] == [".half.json-abc"]
    assert str(tmp_path) not in torn.read_text()


def test_a_changed_value_is_not_taken_over(whole, tmp_path):
    folder = tmp_path / "out"
    shutil.copytree(whole[0], folder)
    rng, changed = np.random.default_rng(5), 0
    for file in sorted((folder / "cells").iterdir()):
        content = file.read_bytes()
        digits = [place for place, byte in enumerate(content) if chr(byte) in "123456789"]
        place = int(rng.choice(digits))
        other = b"1" if content[place : place + 1] != b"1" else b"2"
        file.write_bytes(content[:place] + other + content[place + 1 :])
        changed += 1
    told = []
    run_sweep(DRAW, folder, SweepOptions(jobs=2), tell=told.append)
    assert sum(one.last is not None for one in told) == changed == 12
    assert written(folder) == written(whole[0])


@pytest.mark.parametrize("text", ["{}", "[1]", '{"schema": 1, "checksum": ""}', "\xff", "NaN", "[" * 9999])
def test_a_folder_with_another_sweep_json_is_refused(text, tmp_path):
    (tmp_path / "sweep.json").write_text(text, encoding="latin-1")
    with pytest.raises(ResultError, match=r"sweep\.json: [^\n]+; give another folder$"):
        run_sweep(DRAW, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.json"]


def test_trouble_is_recorded_and_the_rest_goes_on(tmp_path):
    kinds = ("good", "abort", "orphan", "segfault", "leave", "exit", "hang", "raise", "object", "list", "names", "fine")
    sweep = Sweep("sweep_cells:misbehave", (Axis("kind", kinds),))
    report = run_sweep(sweep, tmp_path, SweepOptions(jobs=2, time_limit=1.5))
    found = {row.cell.point["kind"]: (row.state, row.message) for row in report.rows}
    assert found == {
        "good": ("done", ""),
        "abort": ("died", "its process was killed by SIGABRT"),
        "orphan": ("died", "its process was killed by SIGABRT"),
        "segfault": ("died", "its process was killed by SIGSEGV"),
        "leave": ("died", "its process ended with exit code 0"),
        "exit": ("raised", "SystemExit: gone"),
        "hang": ("hung", "not done after 1.5 s, its time limit"),
        "raise": ("raised", "ValueError: no \udcff \u00e9"),
        "object": ("raised", "the cell returned x = object; return numbers, text, lists or mappings"),
        "list": ("raised", "the cell returned list; return a mapping of names to values"),
        "names": ("raised", "the cell returned dict; return a mapping of names to values"),
        "fine": ("done", ""),
    }
    assert len(report.failed) == 10
    # what failed by itself is not tried again, and is in the table
    again = []
    run_sweep(sweep, tmp_path, tell=again.append)
    assert [(t.done, t.failed, t.last) for t in again] == [(2, 10, None)]
    assert "SIGABRT" in (tmp_path / "table.csv").read_text()


def test_a_blow_from_outside_is_tried_again(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    sweep = Sweep("sweep_cells:count", (Axis("x", (1, 2)),), {"blow": True}, local={"marks": str(marks)})
    first = run_sweep(sweep, tmp_path / "out")
    assert {(row.state, row.message) for row in first.rows} == {("lost", "its process was killed by SIGKILL")}
    assert not run_sweep(sweep, tmp_path / "out").failed


def test_retry_does_failed_cells_again(tmp_path):
    sweep = Sweep("sweep_cells:misbehave", (Axis("kind", ("raise",)),))
    run_sweep(sweep, tmp_path)
    told = []
    run_sweep(sweep, tmp_path, SweepOptions(retry=True), tell=told.append)
    assert [row.last.state for row in told if row.last] == ["raised"]


def test_estimate_does_one_cell_at_most(tmp_path):
    report = run_sweep(DRAW, tmp_path, SweepOptions(only_estimate=True))
    assert [row.state for row in report.rows].count("done") == 1
    assert report.cost.cells == 11
    again = run_sweep(DRAW, tmp_path, SweepOptions(only_estimate=True))
    assert [row.state for row in again.rows].count("done") == 1


def test_an_estimate_leaves_the_tables_of_another_sweep_as_they_are(tmp_path):
    """A folder has one name for all axes of a pipeline; what was run is still to be read after a question."""
    run_sweep(DRAW, tmp_path)
    before = {file.name: file.read_bytes() for file in tmp_path.glob("*.*")}
    assert {"sweep.json", "table.csv", "table.json"} <= set(before)
    other = Sweep(DRAW.function, (Axis("x", (7, 8)), Axis("word", ("one",))))
    assert run_sweep(other, tmp_path, SweepOptions(only_estimate=True), grow=pytest.fail).cost.cells == 2
    assert {file.name: file.read_bytes() for file in tmp_path.glob("*.*")} == before
    run_sweep(other, tmp_path)
    assert (tmp_path / "table.csv").read_bytes() != before["table.csv"]


def test_cost_comes_from_similar_cells():
    cells = build_cells(DRAW)
    known = [{"point": {"x": x, "word": "one"}, "seconds": float(x)} for x in (1, 2, 3)]
    # two repetitions of one second with the word 'one', and as many with 'two', whose nearest have the same x
    assert estimate_cost(cells[:4], known, 1) == (4, 1.0, 4.0)
    assert estimate_cost(cells, known, 2) == (12, 2.0, 12.0)
    assert estimate_cost(cells[-1:], known, 8) == (1, 3.0, 3.0)
    assert estimate_cost(cells, [], 2) == (12, None, None)


def test_two_sweeps_do_not_share_a_folder(tmp_path):
    def intrude(told):
        with pytest.raises(ConfigError, match=rf"another sweep is at work there \(process {os.getpid()} on "):
            run_sweep(DRAW, tmp_path)

    run_sweep(Sweep("sweep_cells:misbehave", (Axis("kind", ("good",)),)), tmp_path, tell=intrude)


@pytest.mark.parametrize("bad", [{"jobs": 0}, {"time_limit": 0.0}, {"time_limit": float("nan")}])
def test_bad_effort_is_told(bad):
    with pytest.raises(ConfigError, match="received; give"):
        SweepOptions(**bad)


def start(folder, jobs):
    """A sweep in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, HERE / "sweep_cells.py", str(folder), str(jobs)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True, cwd=HERE,
        # whoever runs the tests in the background may ignore it, and a child inherits that
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL) and None,
    )  # fmt: skip


def tell_of(folder):
    """What the rest of the slow sweep tells."""
    told = []
    run_sweep(sweep_cells.slow_sweep(0.0), folder, SweepOptions(jobs=2), tell=told.append)
    return told


def test_killed_again_and_again_it_ends_with_the_same_bytes(tmp_path):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    run_sweep(sweep_cells.slow_sweep(0.0), whole, SweepOptions(jobs=2))
    rng = np.random.default_rng(3)
    for _ in range(3):
        with start(killed, 2) as process:
            process.stdout.readline()
            time.sleep(rng.uniform(0.0, 0.2))
            os.killpg(process.pid, signal.SIGKILL)
    there = {path.name for path in (killed / "cells").glob("*.json")}
    assert 0 < len(there) < 20, "the sweep had ended, or not begun, when it was killed: the test proves nothing"
    ran = [told.last for told in tell_of(killed) if told.last]
    assert {f"{row.cell.ident}.json" for row in ran} | there == {path.name for path in (whole / "cells").iterdir()}
    assert not {f"{row.cell.ident}.json" for row in ran} & there
    assert written(killed) == written(whole)


def test_interrupt_stops_the_workers_and_keeps_what_is_done(tmp_path):
    with start(tmp_path, 2) as process:
        for _ in range(4):
            process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)
        process.communicate()
    assert process.returncode == -signal.SIGINT
    states = [row["state"] for row in json.loads((tmp_path / "table.json").read_text())]
    assert {"done", "missing"} == set(states)
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)


def test_dask_gives_the_same_bytes(whole, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        host="127.0.0.1",
        protocol="tcp",
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tcp://127.0.0.1:")
        run_sweep(DRAW, tmp_path / "out", SweepOptions(dask=address))
        kinds = Sweep("sweep_cells:misbehave", (Axis("kind", ("good", "abort", "hang")),))
        report = run_sweep(kinds, tmp_path / "kinds", SweepOptions(dask=address, time_limit=1.0))
    assert written(tmp_path / "out") == written(whole[0])
    assert [row.state for row in report.rows] == ["done", "died", "hung"]


def test_no_scheduler_is_one_line(tmp_path, monkeypatch):
    from rislam_rt.sweeps import pools

    monkeypatch.setattr(pools, "CONNECT_SECONDS", 0.2)
    with pytest.raises(SetupError, match=r"^--dask tcp://127\.0\.0\.1:9: no scheduler answers [^\n]*$"):
        run_sweep(DRAW, tmp_path, SweepOptions(dask="tcp://127.0.0.1:9"))


def test_times_that_are_no_text_are_passed_over(tmp_path):
    line = json.dumps({"point": {"a": 1}, "seconds": 2.0})
    endless = [b'{"point": {}, "seconds": %s}' % value for value in (b"NaN", b"Infinity", b"-1", b"1" * 400)]
    lines = [b"\xff\xfe", line.encode(), *endless, b"[" * 100_000, b"{"]
    (tmp_path / "timings.jsonl").write_bytes(b"\n".join(lines))
    assert [entry["seconds"] for entry in read_timings(tmp_path)] == [2.0]
