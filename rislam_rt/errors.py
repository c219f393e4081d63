"""Errors of this package, each with the exit code that the command line ends with.

A message is one line: what was wrong, the value received, and what to do about it. An error may hold several, one for
each fault.
"""

MOST_LINES = 20
"""Faults of one error that are printed one by one; of the others only the number is."""


class RislamError(Exception):
    """Base of all errors that this package raises on purpose; exit code 1.

    Its text is one printable line, the first of its arguments, and says how many more there are.
    """

    exit_code = 1
    """Exit code of the command line."""

    def __str__(self) -> str:
        more = f" (and {len(self.args) - 1} more)" if len(self.args) > 1 else ""
        return _printable(str(self.args[0]) + more) if self.args else ""

    @property
    def lines(self) -> list[str]:
        """Message that errors of this package have in lines: one printable line for each fault, and the number of those
        beyond `MOST_LINES`."""
        told = [_printable(str(text)) for text in self.args[:MOST_LINES]]
        more = len(self.args) - len(told)
        return [*told, f"{more} more of this kind"] if more else told


class ConfigError(RislamError):
    """Error raised for an unusable setting of a pipeline, of the radio or on the command line; exit code 2."""

    exit_code = 2


class SceneError(RislamError):
    """Error raised for an unusable scene file or mesh; exit code 2."""

    exit_code = 2


class ResultError(RislamError):
    """Error raised for a result file that is not as it was written: damaged, changed, or of another run; exit code
    2."""

    exit_code = 2


class GeometryError(RislamError):
    """Error raised for points, directions or planes that have no answer (zero length, wrong shape); exit code 2."""

    exit_code = 2


class TraceError(RislamError):
    """Error raised where the ray tracer failed on a valid scene; exit code 1."""

    exit_code = 1


class SetupError(RislamError):
    """Error raised where the machine lacks something (a library, a version, a device); exit code 3."""

    exit_code = 3


class StoreError(RislamError):
    """Error raised where a result could not be written to disk or read back; exit code 4."""

    exit_code = 4


def disk_error(error: OSError) -> RislamError:
    """Error of this package for an `OSError` of the disk: `ConfigError` for a file that was named, `StoreError` where
    the output cannot be written."""
    said = error.strerror or type(error).__name__
    if error.filename is None:
        return StoreError(f"output: cannot be written ({said}); check where it goes, and the free space")
    return ConfigError(f"{str(error.filename)[:80]}: cannot be used ({said}); check the name and its permissions")


def _printable(text: str) -> str:
    """Text of an error with every unprintable character as a space."""
    return "".join(c if c.isprintable() else " " for c in text)


def expect(name: str, value: object, kind: type | tuple[type, ...]) -> None:
    """Check the type of an argument of a public function, and raise an error for another.

    Raises
    ------
    ConfigError
        It is of another; the line names the argument and both kinds.
    """
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is int):
        wanted = " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        raise ConfigError(f"{name}: {type(value).__name__} received; give a {wanted}")
