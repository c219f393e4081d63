"""The tracer's backend on this machine: which libLLVM, which Dr.Jit variant, how many threads. Chosen once, here.

Dr.Jit takes the first libLLVM it finds and only looks when it is imported. Versions 15 and 16 pass its own check and
then abort the process inside the path solver, where Python cannot catch it. So the library is chosen and its version
read before Dr.Jit is imported, and everything that imports Dr.Jit calls `prepare_backend` first. This module imports
neither Dr.Jit nor the tracer until then.

Environment: `DRJIT_LIBLLVM_PATH` (a user's own libLLVM, wins), `RISLAM_RT_DEVICE` (`llvm`, the default, or `cuda`),
`RISLAM_RT_THREADS` (default 1: with one thread results are the same to the last bit from run to run).
"""

import ctypes
import os
import platform
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from glob import glob
from importlib import import_module, metadata
from pathlib import Path
from threading import current_thread, main_thread

from rislam_rt.errors import SetupError

OLDEST_LLVM = 17
"""Oldest major version of libLLVM that does not abort inside the tracer."""

PYTHONS = ((3, 11), (3, 13))
"""Oldest and newest Python that the tracer runs on."""

_PACKAGES = ("rislam-rt", "sionna-rt", "mitsuba", "drjit", "karellen-llvm-core", "numpy", "scipy")
_SYSTEM_LLVM = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*", "/usr/lib64/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib", "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
)  # fmt: skip
_HOW_TO_GET = (
    f"libLLVM {OLDEST_LLVM} or newer is needed: 'pip install karellen-llvm-core' (Linux x86-64), or install one "
    "from your system (Debian: libllvm19, macOS: brew install llvm) and set DRJIT_LIBLLVM_PATH to it"
)


@dataclass(frozen=True, slots=True)
class BackendInfo:
    """Backend chosen for the ray tracer on this machine: Mitsuba variant, number of threads, and libLLVM."""

    variant: str
    """Mitsuba variant that the ray tracer runs on."""
    threads: int
    """Number of Dr.Jit threads."""
    llvm_path: str
    """Path of libLLVM; empty on CUDA."""
    llvm_version: str
    """Version `major.minor.patch` of libLLVM; empty on CUDA."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One row of the report of `rislam-rt doctor`: part of the machine, what was found, and whether it will do."""

    name: str
    value: str
    ok: bool = True


@cache
def prepare_backend() -> BackendInfo:
    """Check the machine, choose libLLVM, device and threads of the ray tracer, and import Dr.Jit with them; later calls
    cost nothing.

    Raises
    ------
    SetupError
        The machine lacks something; one line says what was found, what is needed and how to get it.
    """
    check_python(sys.version_info[:2])
    check_libatomic()
    device, threads = _device(), _threads()
    path, version = ("", "") if device == "cuda" else _choose_llvm()
    if path:
        os.environ["DRJIT_LIBLLVM_PATH"] = path
    with uninterrupted():
        import_module("drjit").set_thread_count(threads)
    return BackendInfo(f"{device}_ad_mono_polarized", threads, path, version)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay interrupts (SIGINT, SIGTERM) while the ray tracer's backend is loaded, whose extensions may abort the
    process at an exception; the first signal is raised at the end."""
    came: list[int] = []
    kept = {}
    if current_thread() is main_thread():  # no other is interrupted
        for one in (signal.SIGINT, signal.SIGTERM):
            if callable(signal.getsignal(one)):
                kept[one] = signal.signal(one, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for one, answer in kept.items():
            signal.signal(one, answer)
        for number in came[:1]:
            signal.raise_signal(number)


def check_python(version: tuple[int, ...]) -> None:
    """Raise a `SetupError` for a version of Python that the tracer's backend does not run on."""
    if not PYTHONS[0] <= tuple(version[:2]) <= PYTHONS[1]:
        found, (low, high) = ".".join(map(str, version[:2])), [".".join(map(str, v)) for v in PYTHONS]
        raise SetupError(f"Python {found} found, {low} to {high} needed: build the environment anew with one of them")


def check_libatomic(name: str = "libatomic.so.1") -> None:
    """Raise a `SetupError` on a Linux machine without libatomic, where Dr.Jit would fail with a misleading
    NameError."""
    if platform.system() != "Linux":
        return
    try:
        ctypes.CDLL(name)
    except OSError:
        raise SetupError(
            f"{name} not found, the tracer's Dr.Jit needs it: install the package libatomic1 (Fedora: libatomic)"
        ) from None


def llvm_version(path: str) -> str:
    """Version `major.minor.patch` of the libLLVM file at a path.

    Raises
    ------
    SetupError
        The file is no libLLVM, or is too old for the tracer.
    """
    library = _load(path)
    if not hasattr(library, "LLVMGetVersion"):
        if not hasattr(library, "LLVMContextCreate"):
            raise SetupError(f"{path}: not an LLVM library; {_HOW_TO_GET}")
        named = _named_version(path)
        found = f"libLLVM {named[0]}" if named else "libLLVM 15 or older"
        raise SetupError(f"{path}: {found} found, it aborts inside the tracer; {_HOW_TO_GET}")
    numbers = [ctypes.c_uint() for _ in range(3)]
    library.LLVMGetVersion(*(ctypes.byref(n) for n in numbers))
    version = ".".join(str(n.value) for n in numbers)
    if numbers[0].value < OLDEST_LLVM:
        raise SetupError(f"{path}: libLLVM {version} found, it aborts inside the tracer; {_HOW_TO_GET}")
    return version


def diagnose() -> tuple[Diagnosis, ...]:
    """Rows of `rislam-rt doctor`: versions of Python and of the packages, libLLVM, Mitsuba variant, threads, and GPUs
    of this machine. Raises nothing; a row that is not `ok` says what is missing."""
    rows = [Diagnosis("python", f"{platform.python_version()} ({sys.executable})")]
    rows += [_package(name) for name in _PACKAGES]
    try:
        info = prepare_backend()
    except SetupError as error:
        rows.append(Diagnosis("backend", str(error), ok=False))
    else:
        rows.append(Diagnosis("libLLVM", f"{info.llvm_version} ({info.llvm_path})" if info.llvm_path else "not used"))
        rows += [Diagnosis("variant", info.variant), Diagnosis("threads", f"{info.threads} of {os.cpu_count()} cores")]
    gpus = count_gpus()
    rows.append(Diagnosis("GPU", f"{gpus} (RISLAM_RT_DEVICE=cuda uses it)" if gpus else "none (not needed)"))
    return tuple(rows)


def count_gpus() -> int:
    """Number of CUDA devices (GPUs) for the tracer's backend that the driver reports; 0 without a driver."""
    try:
        driver = ctypes.CDLL("libcuda.so.1")
    except OSError:
        return 0
    count = ctypes.c_int(0)
    failed = driver.cuInit(0) != 0 or driver.cuDeviceGetCount(ctypes.byref(count)) != 0
    return 0 if failed else count.value


def _device() -> str:
    """Device of the tracer's backend, `llvm` or `cuda`, from the environment variable RISLAM_RT_DEVICE."""
    device = os.environ.get("RISLAM_RT_DEVICE", "llvm").lower()
    if device not in ("llvm", "cuda"):
        raise SetupError(f"RISLAM_RT_DEVICE: '{device}' received; give 'llvm' or 'cuda'")
    if device == "cuda" and count_gpus() == 0:
        raise SetupError("RISLAM_RT_DEVICE=cuda: no NVIDIA device found; unset it to trace on the CPU")
    return device


def _threads() -> int:
    """Number of Dr.Jit threads, from the environment variable RISLAM_RT_THREADS; by default 1."""
    text = os.environ.get("RISLAM_RT_THREADS", "1")
    if not text.isdecimal() or int(text) < 1:
        raise SetupError(f"RISLAM_RT_THREADS: '{text}' received; give a whole number from 1 on")
    return int(text)


def _choose_llvm() -> tuple[str, str]:
    """Path and version of the libLLVM to use: of DRJIT_LIBLLVM_PATH, else of the wheel, else the system's newest."""
    own = os.environ.get("DRJIT_LIBLLVM_PATH")
    if own:
        if not Path(own).is_file():
            raise SetupError(f"DRJIT_LIBLLVM_PATH: '{own}' is no file; unset it, or {_HOW_TO_GET}")
        return own, llvm_version(own)
    if "drjit" in sys.modules:
        raise SetupError(
            "drjit was imported before libLLVM was chosen: call rislam_rt.tracer_backend.prepare_backend first, "
            "or set DRJIT_LIBLLVM_PATH"
        )
    for path in (*_wheel_llvm(), *_system_llvm()):
        return path, llvm_version(path)
    raise SetupError(f"no libLLVM found; {_HOW_TO_GET}")


def _wheel_llvm() -> Iterator[str]:
    """Path of the libLLVM file of the installed karellen-llvm-core wheel, for the tracer's backend; links to it may be
    missing."""
    try:
        files = metadata.distribution("karellen-llvm-core").files or []
    except metadata.PackageNotFoundError:
        return
    for file in files:
        if re.fullmatch(r"libLLVM\.so\.[\d.]+", file.name):
            yield str(Path(str(file.locate())).resolve())


def _system_llvm() -> list[str]:
    """Paths of the libLLVM files that the system has for the tracer's backend, newest first by their names."""
    paths = {str(Path(p).resolve()) for pattern in _SYSTEM_LLVM for p in glob(pattern)}
    return sorted(paths, key=lambda p: (_named_version(p), p), reverse=True)


def _named_version(path: str) -> tuple[int, ...]:
    """Version in the name of a libLLVM file, e.g. (15,) of `libLLVM-15.so.1`, (19, 1) of `libLLVM.so.19.1`."""
    name = Path(path).resolve().name
    match = re.search(r"libLLVM-(\d+(?:\.\d+)*)", name) or re.search(r"libLLVM\.so\.(\d+(?:\.\d+)*)", name)
    return tuple(int(n) for n in match.group(1).split(".")) if match else ()


def _load(path: str) -> ctypes.CDLL:
    """Open a libLLVM for the tracer's backend, the wheel's C++ runtime first by its full name, if links are missing."""
    try:
        return ctypes.CDLL(path)
    except OSError:
        for stem in ("libunwind.so.1.*", "libc++abi.so.1.*", "libc++.so.1.*"):
            for runtime in glob(str(Path(path).parent / "**" / stem), recursive=True):
                ctypes.CDLL(runtime, mode=ctypes.RTLD_GLOBAL)
    try:
        return ctypes.CDLL(path)
    except OSError as error:
        raise SetupError(f"{path}: cannot be loaded ({error}); {_HOW_TO_GET}") from None


def _package(name: str) -> Diagnosis:
    """Version of an installed package that the tracer's backend needs, a row of `rislam-rt doctor`; only the LLVM wheel
    may be missing."""
    try:
        return Diagnosis(name, metadata.version(name))
    except metadata.PackageNotFoundError:
        needed = name != "karellen-llvm-core"
        return Diagnosis(name, "not installed" + ("; run 'make' again" if needed else ""), ok=not needed)
