"""Findings of the scene check: errors, warnings and notes, each with its place in the scene file and how to mend it."""

from dataclasses import dataclass

from rislam_rt.errors import RislamError, SceneError


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding of the scene check. An `error` makes the scene unusable, a `warning` may be meant, a `note` is no
    fault."""

    severity: str
    """`error`, `warning` or `note`."""
    file: str
    """Path of the file to edit."""
    field: str
    """Dotted path of the key in the scene file, or empty."""
    message: str
    """What was found, with the value received."""
    mend: str
    """What to do about it."""

    @property
    def line(self) -> str:
        """Text of a finding of the scene check on one line: file, field, message, and how to mend it."""
        place = f"{self.file}: {self.field}" if self.field else self.file
        return one_line(f"{place}: {self.message}; {self.mend}")


class Fault(SceneError):
    """Error in a scene's file or mesh, raised where its place (file and field) is not known; the caller adds that."""

    def __init__(self, message: str, mend: str, key: str = "") -> None:
        super().__init__(one_line(f"{message}; {mend}"))
        self.message, self.mend = message, mend
        self.key = key
        """Key below the field that the caller names, where one key is at fault."""
        self.faults: list[Fault] = [self]

    @classmethod
    def of(cls, error: RislamError) -> "Fault":
        """Fault with what another error says, which may have a part on how to mend it."""
        what, _, mend = str(error).partition("; ")
        return cls(what, mend)

    def at(self, file: str, field: str) -> Finding:
        """Make this fault a finding of the scene check: an error at the file and field that the caller names."""
        return error_at(file, f"{field}.{self.key}" if self.key else field, self.message, self.mend)


class Faults(Fault):
    """Several faults of one scene file, raised as one exception."""

    def __init__(self, faults: list[Fault]) -> None:
        super().__init__(faults[0].message, faults[0].mend)
        self.args = tuple(str(fault) for fault in faults)
        self.faults = faults


def error_at(file: str, field: str, message: str, mend: str) -> Finding:
    """Make an error of the scene check at a key of the scene file."""
    return Finding("error", file, field, message, mend)


def warning_at(file: str, field: str, message: str, mend: str) -> Finding:
    """Make a warning of the scene check at a key of the scene file."""
    return Finding("warning", file, field, message, mend)


def panel_key(number: int, panels: int) -> str:
    """Key of a RIS panel in the scene file, as findings name it: `ris` of one, `ris[number]` of several."""
    return "ris" if panels == 1 else f"ris[{number}]"


def one_line(text: str) -> str:
    """Text of a finding without line breaks and other control characters (names in hostile files may hold both)."""
    return "".join(c if c.isprintable() else " " for c in " ".join(text.split()))


def raise_errors(findings: list[Finding]) -> None:
    """Raise one exception with a line for each finding of the scene check that is an error.

    Raises
    ------
    SceneError
        There is at least one error.
    """
    errors = [f.line for f in findings if f.severity == "error"]
    if errors:
        raise SceneError(*errors)
