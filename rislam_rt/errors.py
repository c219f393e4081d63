"""Errors, each with the exit code that the command line ends with.

A message is one line: what was wrong, the value received, and what to do about it. An error may hold several, one for
each fault.
"""

MOST_LINES = 20
"""Faults of one error that are printed one by one; of the others only the number is."""


class RislamError(Exception):
    """Any failure that this package raises on purpose; exit code 1.

    Its text is one printable line, the first of its arguments, and says how many more there are.
    """

    exit_code = 1

    def __str__(self) -> str:
        more = f" (and {len(self.args) - 1} more)" if len(self.args) > 1 else ""
        return _printable(str(self.args[0]) + more) if self.args else ""

    @property
    def lines(self) -> list[str]:
        """Lines of an error's message: one printable line for each fault, and the number of those beyond
        `MOST_LINES`."""
        told = [_printable(str(text)) for text in self.args[:MOST_LINES]]
        more = len(self.args) - len(told)
        return [*told, f"{more} more of this kind"] if more else told


class ConfigError(RislamError):
    """A pipeline, radio or command-line setting is unusable."""

    exit_code = 2


class SceneError(RislamError):
    """A scene file or one of its meshes is unusable."""

    exit_code = 2


class ResultError(RislamError):
    """A result file is not as it was written: damaged, changed, or of another run."""

    exit_code = 2


class GeometryError(RislamError):
    """Points, directions or planes that have no answer (zero length, wrong shape)."""

    exit_code = 2


class TraceError(RislamError):
    """The tracer failed on a valid scene."""

    exit_code = 1


class SetupError(RislamError):
    """The machine lacks something: a library, a version, a device."""

    exit_code = 3


class StoreError(RislamError):
    """A result could not be written or read back."""

    exit_code = 4


def disk_error(error: OSError) -> RislamError:
    """Error of this package for an `OSError` of the disk: `ConfigError` for a file that was named, `StoreError` where
    the output cannot be written."""
    said = error.strerror or type(error).__name__
    if error.filename is None:
        return StoreError(f"output: cannot be written ({said}); check where it goes, and the free space")
    return ConfigError(f"{str(error.filename)[:80]}: cannot be used ({said}); check the name and its permissions")


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def expect(name: str, value: object, kind: type | tuple[type, ...]) -> None:
    """Check the type of an argument of a public function.

    Raises
    ------
    ConfigError
        It is of another; the line names the argument and both kinds.
    """
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is int):
        wanted = " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        raise ConfigError(f"{name}: {type(value).__name__} received; give a {wanted}")
