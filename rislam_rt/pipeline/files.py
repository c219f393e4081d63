"""Writing files so that they are there whole or not at all."""

import os
import tempfile
from pathlib import Path

from rislam_rt.errors import StoreError


def write_atomic(path: Path, content: bytes) -> None:
    """Write under a temporary name beside `path`, flush to the disk, rename.

    Raises
    ------
    StoreError
        The disk refused.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise StoreError(f"{path}: cannot be written ({error.strerror}); check permissions and free space") from None
