"""The digest of a method of one's own changes with every file that it is made of, and with no other."""

import hashlib
import importlib.util
import py_compile
import sys
import zipfile
from pathlib import Path

import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline import own_method_files
from rislam_rt.pipeline.own_method_files import imported_files, large_sources, own_digest, own_digests, own_sources
from rislam_rt.pipeline.own_methods import load_own

FILES = {
    "mine.py": "import numpy as np\nimport beside\nfrom tools import deep\n",
    "beside.py": "from tools.more import thing\n",
    "tools/__init__.py": "",
    "tools/deep.py": "from . import near\n",
    "tools/near.py": "from .further.inner import x\n",
    "tools/more.py": "thing = 1\n",
    "tools/further/__init__.py": "",
    "tools/further/inner.py": "x = 1\n",
    "stranger.py": "y = 1\n",
    "tools/unused.py": "z = 1\n",
}


def digest(root: Path, name: str) -> str:
    importlib.invalidate_caches()
    return own_digest(imported_files(name.removesuffix(".py").replace("/", "."), root / name))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    for module in {*sys.modules} & {"mine", "beside", "tools", "stranger"}:
        monkeypatch.delitem(sys.modules, module)
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_every_file_that_is_imported_counts_and_no_other(folder: Path, name: str) -> None:
    before = digest(folder, "mine.py")
    (folder / name).write_text(FILES[name] + "# changed\n")
    unused = name in ("stranger.py", "tools/unused.py")
    assert (digest(folder, "mine.py") == before) == unused


def test_it_is_the_same_in_another_folder(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path_factory.mktemp("elsewhere") / "copy"
    here = digest(folder, "mine.py")
    folder.rename(other)
    monkeypatch.syspath_prepend(other)
    moved = digest(other, "mine.py")
    other.rename(folder)
    assert moved == here


def test_a_file_alone_is_its_bytes(tmp_path: Path) -> None:
    file = tmp_path / "alone.py"
    file.write_text("import numpy\nimport json\n")
    assert digest(file.parent, file.name) == hashlib.sha256(file.read_bytes()).hexdigest()
    file.write_text("import alone\n")  # itself
    assert digest(file.parent, file.name) == hashlib.sha256(file.read_bytes()).hexdigest()
    file.write_text("this is no Python\n")
    assert digest(file.parent, file.name) == hashlib.sha256(file.read_bytes()).hexdigest()


def test_within_a_package_absolute_names_are_looked_up_from_its_root(folder: Path) -> None:
    (folder / "tools" / "deep.py").write_text("import tools.more\n")
    before = digest(folder, "tools/deep.py")
    (folder / "tools" / "more.py").write_text("thing = 2\n")
    assert digest(folder, "tools/deep.py") != before


def test_of_an_installed_method_its_own_package_counts_and_no_library_beside_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own_method_files, "INSTALLED", {folder})
    monkeypatch.syspath_prepend(folder)
    (folder / "tools" / "deep.py").write_text("import beside\nfrom . import near\n")
    digests = {name: digest(folder, name) for name in ("mine.py", "tools/deep.py")}
    (folder / "beside.py").write_text("a_library = 1\n")
    assert {name: digest(folder, name) for name in digests} == digests
    (folder / "tools" / "further" / "inner.py").write_text("x = 2\n")
    assert digest(folder, "mine.py") == digests["mine.py"]
    assert digest(folder, "tools/deep.py") != digests["tools/deep.py"]


DESIGNER = "def design(belief, panel, radio, *, rng):\n    return 0\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of modules of this test alone, named after it, on the path of imports, ahead of `behind`."""
    for folder in ("behind", "front"):
        (tmp_path / folder).mkdir()
        monkeypatch.syspath_prepend(tmp_path / folder)
    return tmp_path / "front"


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def test_a_folder_that_is_no_package_is_kept_in_the_copy(place: Path) -> None:
    methods = f"methods_{place.parent.name}"
    name, more = f"{methods}.nm:design", f"import {methods}.more\n"
    write(place, {f"{methods}/nm.py": more + DESIGNER, f"{methods}/more.py": "x = 1\n"})
    digests = own_digests([name])
    assert set(own_sources(digests)) == {f"{methods}/nm.py", f"{methods}/more.py"}
    write(place, {f"{methods}/more.py": "x = 2\n"})
    assert own_digests([name]) != digests


def test_of_two_files_of_one_name_that_which_is_imported_is_copied(place: Path) -> None:
    one, two, tool = (f"{word}_{place.parent.name}" for word in ("one", "two", "tool"))
    write(place, {f"{one}.py": f"import {tool}\n{DESIGNER}", f"{tool}.py": "first = 1\n"})
    write(place.parent / "behind", {f"{two}.py": f"import {tool}\n{DESIGNER}", f"{tool}.py": "second = 1\n"})
    found = own_sources(own_digests([f"{one}:design", f"{two}:design"]))
    assert set(found) == {f"{one}.py", f"{two}.py", f"{tool}.py"}
    assert found[f"{tool}.py"] == b"first = 1\n"


def test_a_large_file_is_not_copied_and_said(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"large_{place.parent.name}"
    write(place, {f"{name}.py": DESIGNER})
    assert large_sources([f"{name}:design", "random"]) == []
    monkeypatch.setattr(own_method_files, "LARGEST", 10)
    assert own_sources(own_digests([f"{name}:design"])) == {}
    (line,) = large_sources([f"{name}:design", "random"])
    assert line.startswith(f"{name}.py: 0.0 MB, and a run's folder holds copies of at most")


MADE = {
    "a partial function": "from functools import partial\ndef f(*a, rng, x):\n    return x\ndesign = partial(f, x=1)\n",
    "a decorated function": "import numpy as np\n@np.errstate(all='ignore')\n" + DESIGNER,
    "a cached function": "from functools import lru_cache\n@lru_cache\n" + DESIGNER,
    "a function made elsewhere": "from HELPER import make\ndesign = make(1)\n",
    "an object of a class elsewhere": "from HELPER import Designer\ndesign = Designer(1)\n",
    "a lambda": "design = lambda *args, rng: 0\n",
}
HELPER = """
def make(gain):
    return lambda *args, rng: gain
class Designer:
    def __init__(self, gain): self.gain = gain
    def __call__(self, *args, rng): return self.gain
"""


@pytest.mark.parametrize("how", MADE)
def test_the_named_file_counts_however_the_method_is_made(place: Path, how: str) -> None:
    name, helper = (f"{word}_{place.parent.name}" for word in ("made", "helper"))
    text = MADE[how].replace("HELPER", helper)
    write(place, {f"{name}.py": text, f"{helper}.py": HELPER})
    before = own_digests([f"{name}:design"])
    assert f"{name}.py" in own_sources(before)
    write(place, {f"{name}.py": text + "# changed\n"})
    changed = own_digests([f"{name}:design"])
    assert changed != before
    assert f"{name}.py" not in own_sources(before)  # it is not what has run
    write(place, {f"{helper}.py": HELPER + "# changed\n"})
    assert (own_digests([f"{name}:design"]) != changed) == (helper in text)


@pytest.mark.parametrize("line", ["from . import GAIN", "from .. import GAIN", "import PACKAGE", ""])
def test_init_files_of_the_packages_that_it_is_in_count(place: Path, line: str) -> None:
    package = f"package_{place.parent.name}"
    text = line.replace("PACKAGE", package) + "\n" + DESIGNER
    write(place, {f"{package}/__init__.py": "GAIN = 1\n", f"{package}/sub/__init__.py": "GAIN = 1\n"})
    write(place, {f"{package}/sub/m.py": text})
    name = f"{package}.sub.m:design"
    before = own_digests([name])
    assert set(own_sources(before)) == {f"{package}/{one}" for one in ("__init__.py", "sub/__init__.py", "sub/m.py")}
    for one in ("__init__.py", "sub/__init__.py"):
        write(place, {f"{package}/{one}": "GAIN = 2\n"})
        assert own_digests([name]) != before
        before = own_digests([name])


def test_what_lies_beside_this_package_takes_nothing_of_it() -> None:
    text = b"import rislam_rt\nfrom rislam_rt.model import Paths\nimport beside\n"
    assert own_method_files._imported_names(text, "") == ["beside"]


@pytest.mark.parametrize("site", ["site-packages", "dist-packages"])
def test_whatever_folder_of_installed_libraries_it_is_in_it_is_not_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, site: str
) -> None:
    folder, name = tmp_path / "elsewhere" / site, f"installed_{tmp_path.name}"
    helper, stranger = f"helper_{tmp_path.name}", f"stranger_{tmp_path.name}"
    text = f"import {helper}\nimport {stranger}\n{DESIGNER}"
    write(folder, {f"{name}.py": text, f"{helper}.py": "x = 1\n", f"{stranger}.py": "x = 1\n"})
    record = f"{name}.py,,\n{helper}.py,,\nmine.dist-info/RECORD,,\n"
    metadata = "Metadata-Version: 2.1\nName: mine\nVersion: 1\n"
    write(folder, {"mine.dist-info/RECORD": record, "mine.dist-info/METADATA": metadata})
    (tmp_path / "link").symlink_to(folder)
    monkeypatch.syspath_prepend(tmp_path / "link")
    before = own_digests([f"{name}:design"])
    assert before[f"{name}:design"]
    assert own_sources(before) == {}
    write(folder, {f"{stranger}.py": "x = 2\n"})
    assert own_digests([f"{name}:design"]) == before
    write(folder, {f"{helper}.py": "x = 2\n"})  # of the same distribution
    assert own_digests([f"{name}:design"]) != before


def test_a_package_that_is_found_by_no_folder_is_its_own_wherever_one_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = f"edited_{tmp_path.name}"
    write(tmp_path / "dev" / "flat", {f"{package}/__init__.py": "", f"{package}/helper.py": "x = 1\n"})
    write(tmp_path / "dev" / "flat", {f"{package}/m.py": f"from {package} import helper\n" + DESIGNER})
    root = tmp_path / "dev" / "flat" / package
    spec = importlib.util.spec_from_file_location(package, root / "__init__.py", submodule_search_locations=[str(root)])
    loaded = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, package, loaded)  # as the finder of an editable install does
    name, found = f"{package}.m:design", []
    for folder in (tmp_path / "dev", tmp_path / "dev" / "flat"):
        with monkeypatch.context() as context:
            context.syspath_prepend(folder)
            found.append(own_digests([name]))
            assert set(own_sources(found[-1])) == {f"{package}/{one}.py" for one in ("__init__", "helper", "m")}
    assert found[0] == found[1]
    write(root, {"helper.py": "x = 2\n"})
    assert own_digests([name]) != found[0]


@pytest.mark.parametrize("place_of_it", [
    "if True:\n    import HELPER\n", "def late():\n    from HELPER import x\n",
    "class A:\n    def f(self):\n        import HELPER\n",
    "try:\n    1 / 0\nexcept ZeroDivisionError:\n    import HELPER\n", "match 1:\n    case 1:\n        import HELPER\n",
    "with open('/dev/null'):\n    import HELPER\n", "for i in ():\n    pass\nelse:\n    import HELPER\n",
])  # fmt: skip
def test_an_import_counts_in_whatever_block_it_stands(place: Path, place_of_it: str) -> None:
    tool = f"tool_{place.parent.name}"
    write(place, {"mine.py": place_of_it.replace("HELPER", tool) + DESIGNER, f"{tool}.py": "x = 1\n"})
    assert set(imported_files("mine", place / "mine.py")) == {"mine.py", f"{tool}.py"}


def test_a_long_chain_of_branches_is_read(place: Path) -> None:
    tool = f"tool_{place.parent.name}"
    chain = "if 0:\n    pass\n" + "elif 0:\n    pass\n" * 1500 + f"else:\n    import {tool}\n"
    write(place, {"mine.py": chain + DESIGNER, f"{tool}.py": ""})
    assert set(imported_files("mine", place / "mine.py")) == {"mine.py", f"{tool}.py"}


@pytest.mark.parametrize("line", ["from NS.t import LEVEL", "import NS.t", "from NS import t"])
def test_every_folder_of_a_namespace_package_is_looked_in(place: Path, line: str) -> None:
    name, space = (f"{word}_{place.parent.name}" for word in ("user", "ns"))
    write(place, {f"{name}.py": line.replace("NS", space) + "\n" + DESIGNER, f"{space}/readme.txt": ""})
    write(place.parent / "behind", {f"{space}/t.py": "LEVEL = 0\n"})
    before = own_digests([f"{name}:design"])
    assert set(own_sources(before)) == {f"{name}.py", f"{space}/t.py"}
    write(place.parent / "behind", {f"{space}/t.py": "LEVEL = 1\n"})
    assert own_digests([f"{name}:design"]) != before


def test_an_object_of_a_librarys_class_counts_no_library(place: Path) -> None:
    name = f"vector_{place.parent.name}"
    write(place, {f"{name}.py": "import numpy as np\ndesign = np.vectorize(lambda *args: 0)\n"})
    assert own_digests([f"{name}:design"]) == {
        f"{name}:design": hashlib.sha256((place / f"{name}.py").read_bytes()).hexdigest()
    }


def test_a_file_that_is_moved_away_costs_its_copy_alone(place: Path) -> None:
    name, helper = (f"{word}_{place.parent.name}" for word in ("moved", "kept"))
    write(place, {f"{name}.py": f"import {helper}\n" + DESIGNER, f"{helper}.py": "x = 1\n"})
    before = own_digests([f"{name}:design"])
    (place / f"{name}.py").unlink()
    assert set(own_sources(before)) == {f"{helper}.py"}
    assert large_sources([f"{name}:design"]) == []


def test_a_namespace_within_a_namespace_that_is_imported_late_counts(place: Path) -> None:
    name, lib = (f"{word}_{place.parent.name}" for word in ("late", "lib"))
    text = DESIGNER.replace("    return 0", f"    from {lib}.sub.deep import v\n    return v")
    write(place, {f"{name}.py": text, f"{lib}/sub/deep.py": "v = 1\n"})
    before = own_digests([f"{name}:design"])
    load_own(f"{name}:design")(0, 0, 0, rng=0)
    assert own_digests([f"{name}:design"]) == before
    assert set(own_sources(before)) == {f"{name}.py", f"{lib}/sub/deep.py"}


@pytest.mark.parametrize("stand_in", [
    "class M:\n    def design(self, *args, rng):\n        return 0\nsys.modules[__name__] = M()\n",
    "class M:\n    def __getattr__(self, name):\n        return 1\nsys.modules[__name__] = M()\n",
    "class M(dict):\n    def __getattr__(self, name):\n        return self[name]\nsys.modules[__name__] = M()\n",
])  # fmt: skip
def test_a_module_with_another_object_in_its_place_counts(place: Path, stand_in: str) -> None:
    name, user = (f"{word}_{place.parent.name}" for word in ("standin", "user"))
    write(place, {f"{name}.py": "import sys\n" + stand_in, f"{user}.py": f"import {name}\n{DESIGNER}"})
    for method in (f"{user}:design", *([f"{name}:design"] if "def design" in stand_in else [])):
        assert f"{name}.py" in own_sources(own_digests([method]))


@pytest.mark.parametrize("text", [
    "def design(*args, rng):\n    return 0\ndesign.__wrapped__ = design\n",
    "class Proxy:\n    def __getattr__(self, name):\n        return self\n    def __call__(self):\n        return 0\n"
    "design = Proxy()\n",
    "class P:\n    def __getattr__(self, name):\n        return P()\n    def __call__(self):\n        return 0\n"
    "design = P()\n",
])  # fmt: skip
def test_a_method_that_wraps_itself_ends(place: Path, text: str) -> None:
    name = f"round_{place.parent.name}"
    write(place, {f"{name}.py": text})
    assert own_digests([f"{name}:design"])[f"{name}:design"]


def test_folders_that_cannot_be_looked_in_are_passed_over(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"locked_{place.parent.name}"
    write(place, {f"{name}.py": "import json\nimport absent_everywhere\n" + DESIGNER.replace("0", "1")})
    (place / "loop").symlink_to(place / "loop")
    monkeypatch.setattr(sys, "path", [str(place / "loop"), str(place / "nowhere"), b"", None, *sys.path])
    assert set(imported_files(name, place / f"{name}.py")) == {f"{name}.py"}


def test_an_installed_package_of_links_is_installed(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site, cache = tmp_path / "env" / "site-packages", tmp_path / "cache"
    name = f"linked_{tmp_path.name}"
    write(cache, {f"{name}/__init__.py": "", f"{name}/m.py": DESIGNER})
    site.mkdir(parents=True)
    (site / name).symlink_to(cache / name)
    monkeypatch.syspath_prepend(site)
    before = own_digests([f"{name}.m:design"])
    assert before[f"{name}.m:design"]
    assert own_sources(before) == {}


def test_an_archive_is_refused_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"packed_{tmp_path.name}"
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as archive:
        archive.writestr(f"{name}.py", DESIGNER)
    monkeypatch.syspath_prepend(tmp_path / "packed.zip")
    with pytest.raises(ConfigError, match=f"'{name}:design': .*packed.zip.* is in an archive"):
        own_digests([f"{name}:design"])


@pytest.mark.parametrize("text", [None, "raise SystemExit(3)\n", "1 / 0\n"])
def test_what_cannot_be_loaded_is_one_line(place: Path, text: str | None) -> None:
    name = f"broken_{place.parent.name}"
    write(place, {} if text is None else {f"{name}.py": text})
    for ask in (own_digests, large_sources):
        with pytest.raises(ConfigError, match=f"'{name}:design'"):
            ask([f"{name}:design"])


def test_a_star_that_is_reached_late_counts_from_the_first(place: Path) -> None:
    name, late, package = (f"{word}_{place.parent.name}" for word in ("user", "late", "starry"))
    write(place, {f"{name}.py": DESIGNER.replace("    return", f"    import {late}\n    return")})
    write(place, {f"{late}.py": f"from {package}.two import *\n", f"{package}/two.py": "from . import *\n"})
    write(place, {f"{package}/__init__.py": "__all__ = ['one']\n", f"{package}/one.py": ""})
    before = own_digests([f"{name}:design"])
    load_own(f"{name}:design")(0, 0, 0, rng=0)
    assert own_digests([f"{name}:design"]) == before
    inside = {f"{package}/{one}.py" for one in ("__init__", "one", "two")}
    assert set(own_sources(before)) == {f"{name}.py", f"{late}.py", *inside}


def test_an_installed_method_without_a_record_or_a_source_has_a_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site, name = tmp_path / "site-packages", f"compiled_{tmp_path.name}"
    write(site, {f"{name}/__init__.py": "", f"{name}/m.py": DESIGNER})
    py_compile.compile(str(site / name / "m.py"), cfile=str(site / name / "m.pyc"))
    (site / name / "m.py").unlink()
    monkeypatch.syspath_prepend(site)
    before = own_digests([f"{name}.m:design"])
    (site / name / "m.pyc").write_bytes(b"another")
    assert own_digests([f"{name}.m:design"]) != before


def test_the_hint_names_the_file_in_its_folder() -> None:
    with pytest.raises(ConfigError, match=r"no module 'nowhere\.nm'; put nowhere/nm\.py beside the pipeline file"):
        load_own("nowhere.nm:design")
