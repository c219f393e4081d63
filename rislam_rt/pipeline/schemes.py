"""The schemes that a run compares: the panel and its codes, and who estimates from what is measured."""

from typing import NamedTuple


class Scheme(NamedTuple):
    """One way to run the room. All else, motion, channel and noise included, is the same for all schemes."""

    method: str | None
    """Name of a designer; `spec`: the one that the pipeline names; None: a plain wall in the panel's place."""
    on_truth: bool = False
    """Whether the design sees the true pose and map: a reference that no agent can reach."""
    estimator: str = "slam"
    """Name in `pipeline.estimators.ESTIMATORS`."""

    @property
    def panel(self) -> bool:
        """Whether the scheme has a panel."""
        return self.method is not None


SCHEMES: dict[str, Scheme] = {
    "optimized": Scheme("spec"),
    "random": Scheme("random"),
    "exact": Scheme("exact"),
    "genie": Scheme("spec", on_truth=True),
    "no_ris": Scheme(None),
    "bp_slam": Scheme("random", estimator="bp_slam"),
    "channel_slam": Scheme("random", estimator="channel_slam"),
    "bp_slam_no_ris": Scheme(None, estimator="bp_slam"),
    "channel_slam_no_ris": Scheme(None, estimator="channel_slam"),
}
"""All schemes by name."""
