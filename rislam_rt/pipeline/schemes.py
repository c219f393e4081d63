"""The schemes that a run compares: how the panel's code is chosen, and whether there is a panel at all."""

from typing import NamedTuple


class Scheme(NamedTuple):
    """One way to run the room's panel. Everything else, noise included, is the same for all schemes."""

    method: str | None
    """Name of a designer; `spec` stands for the one that the pipeline names; None if there is no panel."""
    on_truth: bool = False
    """Whether the design sees the true pose and map: a reference that no agent can reach."""


SCHEMES: dict[str, Scheme] = {
    "optimized": Scheme("spec"),
    "random": Scheme("random"),
    "exact": Scheme("exact"),
    "genie": Scheme("spec", on_truth=True),
    "no_ris": Scheme(None),
}
"""All schemes by name."""
