"""File names in a scene folder from the names of walls, scatterers and rooms, which may be in any script."""

import hashlib
import re
import unicodedata

PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-]*")
"""Names that every file system takes."""


def safe_name(name: str) -> str:
    """File name for a name in any script: the name itself if every file system takes it, else its plain letters with a
    hash that tells it from others.

    >>> safe_name("wall_x0"), safe_name("Wände")
    ('wall_x0', 'Wande-8cc563f3')
    """
    if PLAIN.fullmatch(name) and not name.endswith("."):
        return name
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", plain).strip("_")
    return f"{plain or 'name'}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
