"""Do the tests notice when the theory is wrong? A random sample of mutants of two folders, and which of them survive.

One mutant is one change in the body of a function: an operator, a comparison, a number, two arguments in the other
order, a statement left out. Type annotations, docstrings and the texts of errors are left alone, and so are defaults of
settings. The folder's tests are imported once; every mutant is a forked process in which the code of the function is
exchanged, and which runs the tests that call it, the quickest first, up to the first failure. Tests that take longer
than `--slowest` seconds of CPU are left out, so that the score is a lower bound.
Run: `python benchmarks/mutation.py [--folders information design] [--sample 150] [--seed 1]`. Survivors are listed; a
mutant that changes nothing that can be seen (a guard against 0 that is twice as large) is among them.
"""

import argparse
import ast
import copy
import gc
import json
import os
import random
import select
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, NamedTuple

import pytest
from scipy.stats import binomtest

ROOT = Path(__file__).parents[1]
LIMIT = 40.0
"""[s] A mutant that runs longer counts as killed: the tests do not end."""
OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.MatMult: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
COMPARISONS: dict[type, tuple[type, ...]] = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}  # fmt: skip


class Mutant(NamedTuple):
    """One change."""

    file: Path
    function: str
    """Qualified name of the outermost function or method that holds it."""
    line: int
    before: str
    after: str
    tree: ast.Module


class Outcome(NamedTuple):
    """What became of one."""

    mutant: Mutant
    killed: bool
    by: str
    """The test that failed, `time` or nothing."""


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """What may stand in place of a node."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        yield ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    elif isinstance(node, ast.AugAssign) and type(node.op) in OPERATORS:
        yield ast.AugAssign(node.target, OPERATORS[type(node.op)](), node.value)
        yield ast.Pass()
    elif isinstance(node, ast.Compare):
        for other in COMPARISONS.get(type(node.ops[0]), ()):
            yield ast.Compare(node.left, [other(), *node.ops[1:]], node.comparators)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        yield ast.Constant(node.value + 1)
    elif isinstance(node, ast.Constant) and isinstance(node.value, float | complex):
        yield ast.Constant(2.0 * node.value if node.value else 1.0)
    elif isinstance(node, ast.Call) and len(node.args) >= 2 and not any(isinstance(a, ast.Starred) for a in node.args):
        yield ast.Call(node.func, [node.args[1], node.args[0], *node.args[2:]], node.keywords)
    elif removable(node):
        yield ast.Pass()


def removable(node: ast.AST) -> bool:
    """Whether a statement can be left out and leave code that runs: a raise, a call, a change of what is there."""
    if isinstance(node, ast.Assign):
        return isinstance(node.targets[0], ast.Subscript | ast.Attribute)
    return isinstance(node, ast.Raise) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))


def places(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None]]:
    """Every node below that may be changed, by parent, field and place in the field; errors' texts are left out."""
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list", "type_comment") or isinstance(node, ast.arguments):
            continue
        for number, child in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(child, ast.AST):
                yield node, field, number if isinstance(value, list) else None
                if not isinstance(child, ast.Raise | ast.JoinedStr):
                    yield from places(child)


def functions(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    """Outermost functions and methods by qualified name."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            yield prefix + node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from functions(node, f"{prefix}{node.name}.")


def all_mutants(folder: Path) -> list[Mutant]:
    """All changes of all functions of a folder."""
    found = []
    for file in sorted(folder.glob("*.py")):
        tree = ast.parse(file.read_text())
        for name, function in functions(tree):
            for parent, field, number in places(function):
                old = getattr(parent, field) if number is None else getattr(parent, field)[number]
                for new in changes(old):
                    ast.copy_location(new, old)
                    _put(parent, field, number, new)
                    changed = ast.fix_missing_locations(copy.deepcopy(tree))
                    _put(parent, field, number, old)
                    found.append(Mutant(file, name, old.lineno, ast.unparse(old), ast.unparse(new), changed))  # type: ignore[attr-defined]
    return found


def _put(parent: ast.AST, field: str, number: int | None, node: ast.AST) -> None:
    """Set a child."""
    if number is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[number] = node


class Runner:
    """A pytest plugin: its test loop tries mutants instead."""

    def __init__(self, mutants: Sequence[Mutant], slowest: float) -> None:
        self.mutants = mutants
        self.slowest = slowest
        self.outcomes: list[Outcome] = []

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """One forked process notes what each test calls, and how long it takes; then one a mutant."""
        called = json.loads(forked(lambda: json.dumps(self._survey(session.items)), 600.0))
        assert called, "the tests fail without a mutant"
        for number, mutant in enumerate(self.mutants):
            key = f"{mutant.file}:{mutant.function}"
            chosen = sorted(
                (row["seconds"], item.nodeid, item)
                for row, item in zip(called, session.items, strict=True)
                if key in row["calls"] and row["seconds"] <= self.slowest
            )
            by = forked(lambda m=mutant, c=chosen: self._try(m, [item for *_, item in c]), LIMIT)  # type: ignore[misc]
            assert not by.startswith("error:"), f"{mutant.file}:{mutant.line}: {by}"
            self.outcomes.append(Outcome(mutant, by != "", by))
            print(f"\r{number + 1}/{len(self.mutants)}", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        return True

    def _survey(self, items: Sequence[pytest.Item]) -> list[dict[str, Any]]:
        """For each test the outermost functions it calls and its CPU time [s]; nothing at all if one fails."""
        names: dict[CodeType, str] = {}
        rows = []
        for item in items:
            seen: set[str] = set()

            def note(frame: Any, event: str, _: Any, seen: set[str] = seen) -> None:
                code = frame.f_code
                if code not in names:
                    names[code] = f"{code.co_filename}:{code.co_qualname.split('.<locals>')[0]}"
                seen.add(names[code])

            sys.setprofile(note)
            begin = time.process_time()
            failed = not passes(item)
            seconds = time.process_time() - begin
            sys.setprofile(None)
            if failed:
                return []
            rows.append({"calls": sorted(name for name in seen if str(ROOT) in name), "seconds": seconds})
        return rows

    def _try(self, mutant: Mutant, items: Sequence[pytest.Item]) -> str:
        """The first test that fails on a mutant."""
        exchange(mutant)
        return next((item.nodeid for item in items if not passes(item)), "")


def passes(item: pytest.Item) -> bool:
    """Run one test with its fixtures."""
    from _pytest.runner import runtestprotocol

    return all(report.passed or report.skipped for report in runtestprotocol(item, log=False, nextitem=None))


def exchange(mutant: Mutant) -> None:
    """Give every function that was made from the mutant's file the code of the mutant's."""
    fresh: dict[str, CodeType] = {}

    def collect(code: CodeType) -> None:
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                fresh[constant.co_qualname] = constant
                collect(constant)

    collect(compile(mutant.tree, str(mutant.file), "exec"))
    for thing in gc.get_objects():
        if isinstance(thing, FunctionType) and thing.__code__.co_filename == str(mutant.file):
            code = fresh.get(thing.__code__.co_qualname)
            if code is not None and code.co_freevars == thing.__code__.co_freevars:
                thing.__code__ = code


def forked(work: Any, limit: float) -> str:
    """The text that `work` returns in a process of its own; `time` if it takes longer than `limit` [s]."""
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        try:
            text = work()
        except BaseException as error:
            text = f"error: {type(error).__name__}"
        os.write(writing, text.encode()) if len(text) < 60_000 else _write_all(writing, text.encode())
        os._exit(0)
    os.close(writing)
    parts, end = [], time.monotonic() + limit
    while (left := end - time.monotonic()) > 0.0 and select.select([reading], [], [], left)[0]:
        part = os.read(reading, 65536)
        if not part:
            break
        parts.append(part)
    else:
        os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    os.close(reading)
    return b"".join(parts).decode() if end > time.monotonic() else "time"


def _write_all(pipe: int, content: bytes) -> None:
    """Write more than a pipe holds."""
    while content:
        content = content[os.write(pipe, content) :]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folders", nargs="+", default=["information", "design"])
    parser.add_argument("--sample", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--slowest", type=float, default=3.0)
    options = parser.parse_args()
    lines = ["| folder | mutants | tried | killed | score | 95 % interval |", "| --- | --- | --- | --- | --- | --- |"]
    survivors: list[Mutant] = []
    for folder in options.folders:
        every = all_mutants(ROOT / "rislam_rt" / folder)
        chosen = random.Random(options.seed).sample(every, min(options.sample, len(every)))
        runner = Runner(chosen, options.slowest)
        pytest.main(["-q", "-x", "-p", "no:cacheprovider", str(ROOT / "tests" / folder)], plugins=[runner])
        killed = sum(outcome.killed for outcome in runner.outcomes)
        interval = binomtest(killed, len(chosen)).proportion_ci(method="exact")
        lines.append(
            f"| {folder} | {len(every)} | {len(chosen)} | {killed} | {killed / len(chosen):.1%} "
            f"| {interval.low:.1%} to {interval.high:.1%} |"
        )
        survivors += [outcome.mutant for outcome in runner.outcomes if not outcome.killed]
    print("\n".join(lines), "\n\nSurvivors:\n")
    for mutant in sorted(survivors, key=lambda m: (str(m.file), m.line)):
        place = f"{mutant.file.relative_to(ROOT / 'rislam_rt')}:{mutant.line}"
        print(f"- {place} {mutant.function}: `{mutant.before}` -> `{mutant.after}`")


if __name__ == "__main__":
    main()
