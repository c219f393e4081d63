"""Writing a large file piece by piece, so that it is there whole or not at all and never all in memory."""

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from rislam_rt.pipeline.files import PREFIX, SUFFIX, refused


def write_pieces(path: Path, pieces: Iterable[bytes]) -> None:
    """As `write_atomic`, of content that comes in pieces.

    Raises
    ------
    StoreError
        The disk refused.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=PREFIX, suffix=SUFFIX, dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                for piece in pieces:
                    file.write(piece)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise refused(path, error) from None
