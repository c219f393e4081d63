"""Lock on a folder, so that one process at a time writes there.

The lock is the kernel's (`flock`), which ends with the process however that ends: a process that died leaves a lock
file behind, and the next one takes it over. The file names the process that holds it.
"""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rislam_rt.errors import ConfigError
from rislam_rt.storage.files import refused

LOCK_FILE = ".rislam-rt-lock"


@contextmanager
def hold(folder: Path, what: str) -> Iterator[None]:
    """Lock an existing folder against other processes within this context; `what` names the work in error messages.

    Raises
    ------
    ConfigError
        Another process is at work there; the line says which.
    StoreError
        The disk refused.
    """
    file = folder / LOCK_FILE
    try:
        handle = _take(file)
    except BlockingIOError as error:
        other = str(error.args[0])
        text = f"{folder}: another {what} is at work there ({other}); wait for it, or give another folder"
        raise ConfigError(text) from None
    except OSError as error:
        raise refused(file, error) from None
    try:
        yield
    finally:
        # while it is held: who opened it meanwhile finds that it is no longer the file of that name, and asks again
        with suppress(OSError):
            file.unlink()
        os.close(handle)


def _take(file: Path) -> int:
    """Open and lock a lock file, write number and machine of this process to it, and return its handle; a
    `BlockingIOError` names the process that holds it."""
    while True:
        handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            _lock(handle)
            if os.path.samestat(os.fstat(handle), os.stat(file)):
                with suppress(OSError):  # a full disk: the lock holds without a name
                    os.ftruncate(handle, 0)
                    os.pwrite(handle, json.dumps({"pid": os.getpid(), "host": os.uname().nodename}).encode(), 0)
                return handle
        except FileNotFoundError:
            pass
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _lock(handle: int) -> None:
    """Take the kernel's lock on an open file, or without such locks rely on the process that the file names."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BlockingIOError(_holder(handle)[0]) from None
    except OSError:  # a file system without locks: what the file says is all there is
        name, alive = _holder(handle)
        if alive:
            raise BlockingIOError(name) from None


def _holder(handle: int) -> tuple[str, bool]:
    """Name of the process that a lock file names, and whether it is alive as far as this machine can tell."""
    try:
        said = json.loads(os.pread(handle, 1000, 0))
        pid, host = int(said["pid"]), str(said["host"])[:80]
    except (ValueError, KeyError, TypeError):
        return "a process that has not yet said its number", False
    return f"process {pid} on {host}", host != os.uname().nodename or Path(f"/proc/{pid}").exists()
