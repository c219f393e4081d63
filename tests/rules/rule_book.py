"""The project's rules as functions: each takes a source file and yields its breaches, one line each."""

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = "rislam_rt"

FLOORS = {
    0: (
        "errors",
        "constants",
        "arrays",
        "tracer_backend",
        "input_messages",
        "ranges",
        "progress",
        "shipped",
        "toml",
        "worker_pool",
        "blas_threads",
    ),
    1: ("geometry", "storage"),
    2: ("model",),
    3: ("scene", "ris", "waveform"),
    4: ("channel", "information"),
    5: ("measurement", "design", "slam", "evaluate"),
    6: ("pipeline", "sweeps"),
    7: ("studies", "adviser"),
    8: ("report",),
    9: ("cli",),
    10: ("__main__",),
}
FLOOR_OF = {folder: floor for floor, folders in FLOORS.items() for folder in folders}

BLIND = {"slam": ("channel", "scene"), "design": ("channel", "scene"), "information": ("channel", "scene")}
"""Belief never reads truth."""

ONLY_IN = {
    "sionna": ("channel/traced/",),
    "mitsuba": ("channel/traced/",),
    "drjit": ("channel/traced/", "slam/", "tracer_backend.py"),
    "matplotlib": ("report/",),
    "trimesh": ("scene/",),
    "pickle": (),
    "dill": (),
    "joblib": (),
    "cloudpickle": (),
    "random": (),
    "evo": (),
    "deepmimo": (),
    "rerun": ("report/exports/rerun_recording.py",),
}
"""Where a foreign package may be imported inside the package: the tracer in one folder, evo (GPL) nowhere."""

RANDOM_TYPES = {"Generator", "default_rng", "SeedSequence", "BitGenerator", "PCG64", "PCG64DXSM", "Philox", "SFC64"}
VAGUE_NAMES = {"util", "utils", "helper", "helpers", "manager", "managers", "handler", "handlers", "common", "misc"}
MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 60
MAX_FOLDER_LINES = 2500
"""Of a folder's own files, those of its sub-folders not counted."""

REGISTRIES = tuple(
    name + "." + domain
    for name, domain in (
        ("pypi", "org"), ("pythonhosted", "org"), ("registry.npmjs", "org"), ("crates", "io"), ("anaconda", "org"),
        ("proxy.golang", "org"), ("piwheels", "org"), ("test.pypi", "org"),
    )
)  # fmt: skip
"""Put together here, so that this file does not break the rule it checks."""


@dataclass(frozen=True)
class Source:
    """A Python file: its path below the package (`slam/filter.py`), its text and its tree."""

    path: str
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        """All of the tree's, which most rules look through."""
        return list(ast.walk(self.tree))

    @property
    def folder(self) -> str:
        """First part of the path without suffix: the floor's member that it belongs to."""
        return self.path.split("/")[0].removesuffix(".py")


@cache
def package_sources() -> list[Source]:
    """Every Python file of the package."""
    folder = ROOT / PACKAGE
    files = sorted(folder.rglob("*.py"))
    return [Source(file.relative_to(folder).as_posix(), file.read_text(encoding="utf-8")) for file in files]


def imported_modules(source: Source) -> Iterator[tuple[int, str]]:
    """Line and full dotted name of everything a file imports, relative and dynamic imports (by literal) included."""
    parts = [PACKAGE, *source.path.removesuffix(".py").split("/")]
    for node in source.nodes:
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(parts[: len(parts) - node.level]) + "." if node.level else ""
            module = (base + (node.module or "")).rstrip(".")
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and _called(node) in ("import_module", "__import__"):
            yield from ((node.lineno, str(arg.value)) for arg in node.args[:1] if isinstance(arg, ast.Constant))


def floor_breaches(source: Source) -> Iterator[str]:
    """Imports of the package's own parts that go up, or sideways to another folder of the same floor."""
    if source.folder == "__init__":
        return  # the package's front door names everything, and imports it when first used
    if source.folder not in FLOOR_OF:
        yield f"{source.path}: '{source.folder}' stands on no floor; add it to the table"
        return
    for line, module in imported_modules(source):
        words = module.split(".")
        if words[0] != PACKAGE or (len(words) > 1 and words[1] in ("__version__", source.folder)):
            continue
        other = words[1] if len(words) > 1 else ""
        if other not in FLOOR_OF:
            yield f"{source.path}:{line}: imports {module}; name the folder that defines it"
        elif FLOOR_OF[other] > FLOOR_OF[source.folder]:
            yield f"{source.path}:{line}: imports {module} from a higher floor"
        elif FLOOR_OF[other] == FLOOR_OF[source.folder] and FLOOR_OF[other] > 0:
            yield f"{source.path}:{line}: imports {module} from its own floor"


def truth_breaches(source: Source) -> Iterator[str]:
    """Belief that reads truth."""
    for line, module in imported_modules(source):
        words = module.split(".")
        if words[0] == PACKAGE and len(words) > 1 and words[1] in BLIND.get(source.folder, ()):
            yield f"{source.path}:{line}: {source.folder}/ must not see {module}"


def foreign_breaches(source: Source) -> Iterator[str]:
    """Foreign packages outside the folders that may import them."""
    for line, module in imported_modules(source):
        allowed = ONLY_IN.get(module.split(".")[0])
        if allowed is not None and not source.path.startswith(allowed or ("\0",)):
            yield f"{source.path}:{line}: {module} may be imported in {', '.join(allowed) or 'no file'} only"


def random_breaches(source: Source) -> Iterator[str]:
    """Numpy's global random state, generators without a seed, `rng` that is optional or positional."""
    for node in source.nodes:
        if isinstance(node, ast.Attribute) and node.attr not in RANDOM_TYPES and _is_numpy_random(node.value):
            yield f"{source.path}:{node.lineno}: np.random.{node.attr} uses the global state"
        if isinstance(node, ast.Call) and _called(node) == "default_rng" and not node.args and not node.keywords:
            yield f"{source.path}:{node.lineno}: default_rng() without a seed"
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            free = [a.arg for a in node.args.posonlyargs + node.args.args]
            optional = [
                a.arg for a, d in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True) if d is not None
            ]
            if "rng" in free or "rng" in optional:
                yield f"{source.path}:{node.lineno}: {node.name}: rng is keyword only and never optional"


def pickle_breaches(source: Source) -> Iterator[str]:
    """Reading that could execute what it reads."""
    for node in source.nodes:
        if isinstance(node, ast.keyword) and node.arg == "allow_pickle" and ast.unparse(node.value) != "False":
            yield f"{source.path}:{node.value.lineno}: allow_pickle must be False"
        if isinstance(node, ast.Call) and _name(node.func) in ("eval", "exec"):
            yield f"{source.path}:{node.lineno}: {_name(node.func)}()"


def name_breaches(source: Source) -> Iterator[str]:
    """Files and folders whose name says nothing."""
    for part in source.path.removesuffix(".py").split("/"):
        if VAGUE_NAMES & set(part.split("_")):
            yield f"{source.path}: '{part}' says nothing; name it after what it holds"


def size_breaches(source: Source) -> Iterator[str]:
    """Files over 400 lines, functions whose body has over 60 (signature and docstring not counted)."""
    lines = source.text.count("\n")
    if lines > MAX_FILE_LINES:
        yield f"{source.path}: {lines} lines"
    for node in source.nodes:
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            length = (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0
            if length > MAX_FUNCTION_LINES:
                yield f"{source.path}:{node.lineno}: {node.name} has {length} lines"


def crowded_folders(sources: Sequence[Source]) -> Iterator[str]:
    """Folders whose own files have over 2500 lines together."""
    lines: Counter[str] = Counter()
    for source in sources:
        lines[source.path.rpartition("/")[0]] += source.text.count("\n")
    yield from (f"{folder or '.'}: {count} lines" for folder, count in lines.items() if count > MAX_FOLDER_LINES)


def circular_folders(sources: Sequence[Source]) -> Iterator[str]:
    """Folders whose files and sub-folders import each other in a circle: then no order of them has every arrow down.

    A sub-folder counts as one with all that is in it, an import within a function as any other.
    """
    paths = {source.path.removesuffix(".py").removesuffix("/__init__"): source.path for source in sources}
    arrows: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for source in sources:
        for _, module in imported_modules(source):
            target = module.removeprefix(f"{PACKAGE}.").replace(".", "/") if module.startswith(f"{PACKAGE}.") else ""
            while target and target not in paths:
                target = target.rpartition("/")[0]
            if target and paths[target] != source.path:
                above, below = source.path.split("/"), paths[target].split("/")
                depth = next(n for n, (a, b) in enumerate(zip(above, below, strict=False)) if a != b)
                arrows["/".join(above[:depth])][above[depth]].add(below[depth])
    for folder, children in arrows.items():
        try:
            TopologicalSorter(children).prepare()
        except CycleError as error:
            yield f"{folder or '.'}: a circle of imports, {' <- '.join(error.args[1])}"


def docstring_breaches(source: Source) -> Iterator[str]:
    """Public modules, classes, functions and methods without a docstring."""
    if ast.get_docstring(source.tree) is None and source.tree.body:
        yield f"{source.path}: no docstring"
    yield from _undocumented(source, source.tree)


def registry_breaches(path: str, text: str) -> Iterator[str]:
    """Addresses of package registries."""
    hosts = [host for host in REGISTRIES if host in text]
    for number, line in enumerate(text.splitlines() if hosts else (), start=1):
        for host in hosts:
            if re.search(rf"(?<![\w-]){re.escape(host)}\b", line):
                yield f"{path}:{number}: names {host}"


def _undocumented(source: Source, parent: ast.Module | ast.ClassDef) -> Iterator[str]:
    for node in parent.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            if ast.get_docstring(node) is None and not _is_setter(node):
                yield f"{source.path}:{node.lineno}: {node.name} has no docstring"
            if isinstance(node, ast.ClassDef):
                yield from _undocumented(source, node)


def _is_setter(node: ast.FunctionDef | ast.ClassDef) -> bool:
    return any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in node.decorator_list)


def _is_numpy_random(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "random" and _name(node.value) in ("np", "numpy")


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else _name(node.func)


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else ""
