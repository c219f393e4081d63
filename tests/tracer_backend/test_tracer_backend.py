"""The machine's checks: each missing thing is one line, and a libLLVM that would abort never reaches the tracer."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rislam_rt import tracer_backend
from rislam_rt.errors import SetupError

OLD_LLVM = Path("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")


def in_new_python(code, **environment):
    """Run code in a fresh interpreter, in which nothing was chosen yet."""
    clean = {k: v for k, v in os.environ.items() if k not in ("DRJIT_LIBLLVM_PATH", "RISLAM_RT_DEVICE")}
    run = subprocess.run(
        [sys.executable, "-c", code], env=clean | environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


ASK = """
from rislam_rt.tracer_backend import prepare_backend
from rislam_rt.errors import SetupError
try:
    print(prepare_backend())
except SetupError as error:
    print(error.exit_code, error)
"""


def test_importing_the_module_imports_no_tracer():
    code = (
        "import sys, rislam_rt.tracer_backend; print([m for m in ('drjit', 'mitsuba', 'sionna') if m in sys.modules])"
    )
    assert in_new_python(code) == "[]"


def test_chooses_a_library_that_the_tracer_survives():
    info = tracer_backend.prepare_backend()
    assert int(info.llvm_version.split(".")[0]) >= tracer_backend.OLDEST_LLVM
    assert os.environ["DRJIT_LIBLLVM_PATH"] == info.llvm_path
    assert info is tracer_backend.prepare_backend()


def test_a_users_own_library_wins():
    own = tracer_backend.prepare_backend().llvm_path
    assert own in in_new_python(ASK, DRJIT_LIBLLVM_PATH=own)


@pytest.mark.skipif(not OLD_LLVM.exists(), reason="needs a libLLVM 15 to refuse")
def test_llvm_15_is_refused_in_one_line():
    answer = in_new_python(ASK, DRJIT_LIBLLVM_PATH=str(OLD_LLVM))
    assert answer.startswith("3 ")
    assert "\n" not in answer
    for word in (str(OLD_LLVM), "libLLVM 15", "17 or newer", "karellen-llvm-core"):
        assert word in answer


@pytest.mark.skipif(not OLD_LLVM.exists(), reason="needs a libLLVM 15 to refuse")
def test_the_old_libraries_of_the_system_are_refused_without_the_wheel(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
    monkeypatch.setattr(tracer_backend, "_wheel_llvm", lambda: iter(()))
    monkeypatch.setattr(tracer_backend, "_SYSTEM_LLVM", (str(OLD_LLVM.parent / "libLLVM*.so*"),))
    with pytest.raises(SetupError, match=r"libLLVM-?15.*17 or newer is needed"):
        tracer_backend._choose_llvm()


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("DRJIT_LIBLLVM_PATH", "/nowhere/libLLVM.so", "'/nowhere/libLLVM.so' is no file"),
        ("DRJIT_LIBLLVM_PATH", __file__, "cannot be loaded"),
        ("RISLAM_RT_THREADS", "many", "RISLAM_RT_THREADS: 'many' received"),
        ("RISLAM_RT_THREADS", "0", "RISLAM_RT_THREADS: '0' received"),
        ("RISLAM_RT_DEVICE", "tpu", "RISLAM_RT_DEVICE: 'tpu' received"),
    ],
)
def test_bad_settings(setting, value, message):
    answer = in_new_python(ASK, **{setting: value})
    assert answer.startswith("3 ")
    assert message in answer
    assert "\n" not in answer


def test_a_library_that_is_no_llvm(monkeypatch):
    import _ctypes

    with pytest.raises(SetupError, match="not an LLVM library"):
        tracer_backend.llvm_version(_ctypes.__file__)


def test_no_llvm_at_all(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
    monkeypatch.setattr(tracer_backend, "_wheel_llvm", lambda: iter(()))
    monkeypatch.setattr(tracer_backend, "_SYSTEM_LLVM", ())
    with pytest.raises(SetupError, match=r"no libLLVM found; .*pip install karellen-llvm-core"):
        tracer_backend._choose_llvm()


def test_drjit_imported_too_early():
    answer = in_new_python("import drjit\n" + ASK)
    assert "drjit was imported before" in answer


@pytest.mark.parametrize(("version", "good"), [((3, 10), False), ((3, 11), True), ((3, 13), True), ((3, 14), False)])
def test_python_versions(version, good):
    if good:
        tracer_backend.check_python(version)
    else:
        with pytest.raises(SetupError, match=r"3\.11 to 3\.13 needed"):
            tracer_backend.check_python(version)


@pytest.mark.skipif(sys.platform != "linux", reason="a Linux matter")
def test_missing_libatomic_names_the_package():
    tracer_backend.check_libatomic()
    with pytest.raises(SetupError, match=r"libnothere\.so\.1 not found.*libatomic1"):
        tracer_backend.check_libatomic("libnothere.so.1")


def test_versions_in_file_names(tmp_path):
    names = {"libLLVM-15.so.1": (15,), "libLLVM.so.19.1": (19, 1), "libLLVM-14.0.6.so.1": (14, 0, 6), "libLLVM.so": ()}
    for name, version in names.items():
        (tmp_path / name).touch()
        assert tracer_backend._named_version(str(tmp_path / name)) == version


def test_newest_library_of_the_system_first(tmp_path, monkeypatch):
    for name in ("libLLVM-9.so.1", "libLLVM.so.19.1", "libLLVM-15.so.1"):
        (tmp_path / name).touch()
    monkeypatch.setattr(tracer_backend, "_SYSTEM_LLVM", (str(tmp_path / "libLLVM*.so*"),))
    assert [Path(p).name for p in tracer_backend._system_llvm()] == [
        "libLLVM.so.19.1",
        "libLLVM-15.so.1",
        "libLLVM-9.so.1",
    ]


@pytest.mark.skipif(not list(tracer_backend._wheel_llvm()), reason="needs the LLVM wheel")
def test_the_wheel_works_without_its_links(tmp_path):
    """In a read-only environment the wheel cannot make `libc++.so.1` and its like; only the full names are there."""
    library = Path(next(tracer_backend._wheel_llvm()))
    for file in (library, *library.parent.glob("*/lib*.so.1.0")):
        place = tmp_path / file.relative_to(library.parent)
        place.parent.mkdir(exist_ok=True)
        try:
            os.link(file, place)
        except OSError:
            shutil.copyfile(file, place)
    code = ASK + "import drjit.llvm; print(drjit.llvm.Float(1, 2) + 1)"
    answer = in_new_python(code, DRJIT_LIBLLVM_PATH=str(tmp_path / library.name))
    assert f"llvm_path='{tmp_path / library.name}'" in answer
    assert answer.endswith("[2, 3]")


def test_the_doctors_rows(monkeypatch):
    rows = {row.name: row for row in tracer_backend.diagnose()}
    assert {"python", "sionna-rt", "mitsuba", "drjit", "numpy", "libLLVM", "variant", "threads", "GPU"} <= set(rows)
    assert all(row.ok for row in rows.values())


def test_the_doctor_reports_what_is_missing_instead_of_raising(monkeypatch):
    def fails():
        raise SetupError("no libLLVM found")

    monkeypatch.setattr(tracer_backend, "prepare_backend", fails)
    assert [row.value for row in tracer_backend.diagnose() if not row.ok] == ["no libLLVM found"]


def test_an_interrupt_waits_until_the_tracers_libraries_are_loaded(monkeypatch):
    from rislam_rt.channel.traced import tracer_startup

    loaded = []

    class Library:
        def set_thread_count(self, threads):
            loaded.append("drjit")

        def set_variant(self, variant):
            loaded.append("mitsuba")

    def load(name):
        signal.raise_signal(signal.SIGINT)
        loaded.append(name)  # an extension that an exception reaches here aborts the process
        return Library()

    for module, work in (
        (tracer_backend, tracer_backend.prepare_backend),
        (tracer_startup, tracer_startup.start_tracer),
    ):
        loaded.clear()
        with monkeypatch.context() as patch:
            patch.setattr(tracer_startup, "prepare_backend", tracer_backend.prepare_backend)
            patch.setattr(module, "import_module", load)
            # in the background of a shell interrupts are ignored from the start
            before, inherited = signal.default_int_handler, signal.signal(signal.SIGINT, signal.default_int_handler)
            try:
                with pytest.raises(KeyboardInterrupt):
                    work.__wrapped__()
                assert signal.getsignal(signal.SIGINT) is before
            finally:
                signal.signal(signal.SIGINT, inherited)
        wanted = ["drjit", "drjit"] if module is tracer_backend else ["mitsuba", "mitsuba", "sionna.rt"]
        assert loaded == wanted
