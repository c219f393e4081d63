"""Materials of an imported room: given by the user, by the name that the file gives them, or one for all the rest."""

import re
from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any, get_args

from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.input_messages import did_you_mean, nearest
from rislam_rt.model.itu import itu_parameters
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.schema import ItuMaterial

THICKNESS = {
    "asphalt_concrete": 0.05, "brick": 0.12, "carpet_tile": 0.006, "ceiling_board": 0.015, "chipboard": 0.018,
    "clear_acrylic": 0.005, "concrete": 0.2, "floorboard": 0.02, "glass": 0.004, "marble": 0.02,
    "medium_dry_ground": 1.0, "metal": 0.002, "plasterboard": 0.0125, "plywood": 0.012, "very_dry_ground": 1.0,
    "vinyl_tile": 0.003, "wet_ground": 1.0, "wood": 0.03,
}  # fmt: skip
"""Usual thickness [m] of a slab of each material where none is given: of boards in trade, of walls in building. That of
glass is 4 mm: a nominal thickness of float glass (EN 572-2), the pane of a common double-glazed window."""

WORDS = {
    "metal": (
        "metal", "metallic", "steel", "iron", "aluminium", "aluminum", "alu", "copper", "brass", "chrome", "metall",
        "stahl", "mirror", "spiegel",
    ),
    "glass": ("glass", "window", "glas", "fenster"),
    "vinyl_tile": ("vinyl", "linoleum"),
    "carpet_tile": ("carpet", "teppich"),
    "brick": ("brick", "masonry", "ziegel"),
    "plasterboard": (
        "plasterboard", "drywall", "dry_wall", "sheetrock", "gypsum", "plaster", "gips", "gipskarton",
    ),
    "ceiling_board": ("ceiling_board", "ceilingboard", "ceiling_tile", "ceiling_tiles", "acoustic"),
    "chipboard": ("chipboard", "mdf", "particleboard", "laminate"),
    "plywood": ("plywood",),
    "floorboard": ("floorboard", "parquet", "parkett", "planks"),
    "wood": ("wood", "wooden", "hardwood", "oak", "pine", "timber", "holz", "walnut", "door"),
    "marble": ("marble", "granite", "marmor", "tile", "tiles"),
    "concrete": ("concrete", "cement", "beton", "stone"),
    "medium_dry_ground": ("ground", "soil", "grass"),
}  # fmt: skip
"""Words of a material's or node's name and the ITU-R P.2040 material that they stand for, the first that is found. A
mirror is the silver on its back. Linoleum, which P.2040 has not, is a floor covering like vinyl."""

BOARDS = ("floorboard", "plywood", "chipboard")
"""Materials of timber, for which wood stands in at a carrier for which ITU-R P.2040 does not specify them."""


def parse_material(text: str, option: str = "--material") -> dict[str, Any]:
    """Parse a material written as `itu:concrete`, `itu:concrete:0.2` (thickness [m]) or `reflection:0.8` into a table
    of the scene file; `option` names it in errors.

    Raises
    ------
    ConfigError
        It is none of them.
    """
    kind, _, rest = text.strip().partition(":")
    name, _, thickness = rest.partition(":")
    known = get_args(ItuMaterial)
    try:
        if kind == "reflection" and 0.0 < float(rest) <= 1.0:
            return {"reflection": float(rest)}
        if kind == "itu" and name in known and (not thickness or 1e-6 <= float(thickness) <= 1e5):
            return {"itu": name, "thickness_m": float(thickness) if thickness else THICKNESS[name]}
    except ValueError:
        pass
    if kind == "itu" and name not in known:
        mend = did_you_mean(nearest(name.lower(), known)) or f"give one of {', '.join(known)}"
        raise ConfigError(f"{option}: '{name[:40]}' is no ITU material; {mend}")
    wanted = "give itu:NAME, itu:NAME:THICKNESS_M or reflection:R with R in (0, 1]"
    raise ConfigError(f"{option}: '{text[:60]}' received; {wanted}")


def parse_choices(texts: list[str]) -> dict[str, dict[str, Any]]:
    """Parse the materials that a user gives to an import, `NAME=itu:concrete`: name or pattern (`wall_*`) to table.

    Raises
    ------
    ConfigError
        An entry cannot be read.
    """
    choices = {}
    for text in texts:
        name, equals, material = text.partition("=")
        if not equals or not name.strip():
            raise ConfigError(f"--material: '{text[:60]}' received; give NAME=itu:concrete or NAME=reflection:0.8")
        choices[name.strip()] = parse_material(material)
    return choices


class MaterialAssignment:
    """Assignment of materials to the walls of an imported room, which keeps account of those it had to assume."""

    def __init__(self, choices: dict[str, dict[str, Any]], rest: dict[str, Any], carrier: float) -> None:
        self.choices, self.rest, self.carrier = choices, rest, carrier
        self.used: set[str] = set()
        self.assumed: set[str] = set()
        self.replaced: dict[str, str] = {}

    def material(self, wall: str, node: str, material: str) -> dict[str, Any]:
        """Material of an imported wall: the user's, else by a word in its material's or node's name, else `rest`; what
        is not specified at the carrier [Hz] is replaced."""
        chosen = self.by_hand(wall, material, node)
        if chosen is not None:
            return chosen
        for name in (material, node):
            found = itu_by_word(name)
            if found is not None:
                return self._at_carrier(found)
        self.assumed.add(material or wall)
        return self.rest

    def _at_carrier(self, itu: str) -> dict[str, Any]:
        """Material of an import by its name; where it is not specified at the carrier wood for boards, else `rest`."""
        try:
            itu_parameters(itu, self.carrier)
        except SceneError:
            other = {"itu": "wood", "thickness_m": THICKNESS[itu]} if itu in BOARDS else self.rest
            self.replaced[itu] = ", ".join(f"{value}" for value in other.values())
            return other
        return {"itu": itu, "thickness_m": THICKNESS[itu]}

    def by_hand(self, *names: str) -> dict[str, Any] | None:
        """Material of an import that the user gave for any of the names, also in other capitals if none is so written;
        None if there is none."""
        for fold in (str, str.casefold):
            for pattern, table in self.choices.items():
                if any(fnmatchcase(fold(name), fold(pattern)) for name in names if name):
                    self.used.add(pattern)
                    return table
        return None

    def remarks(self) -> list[str]:
        """Remarks on the walls of an import whose material was assumed or replaced, a line each; none without any."""
        at = f"is not specified at {self.carrier / 1e9:g} GHz, taken as"
        remarks = [f"'{itu}' {at} {other} (--material NAME=...)" for itu, other in self.replaced.items()]
        if not self.assumed:
            return remarks
        names, what = sorted(self.assumed), ", ".join(f"{value}" for value in self.rest.values())
        more = f" and {len(names) - 8} more" if len(names) > 8 else ""
        return [*remarks, f"material unknown, taken as {what}: {', '.join(names[:8])}{more} (--material NAME=...)"]

    def check_used(self, names: Iterable[str]) -> None:
        """Check that every material given for an import has been used; `names`: some that could have been meant.

        Raises
        ------
        Fault
            A pattern of materials matches nothing.
        """
        unused = sorted(set(self.choices) - self.used)
        if unused:
            few = ", ".join([*names][:12])
            raise Fault(f"--material {unused[0]}: nothing has that name", f"give one of: {few}")


def itu_by_word(name: str) -> str | None:
    """ITU material that a word in the name of an imported material or node stands for, `Oak.003` for wood."""
    plain = f"_{re.sub(r'[^a-z]+', '_', name.lower())}_"
    known = [*((itu, (itu,)) for itu in get_args(ItuMaterial)), *WORDS.items()]
    return next((itu for itu, words in known if any(f"_{word}_" in plain for word in words)), None)
