"""The schemes that a run compares: the panel and its codes, and who estimates from what is measured."""

from typing import NamedTuple

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.own_methods import is_own, load_own
from rislam_rt.spelling import did_you_mean, nearest


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


class Schemes(dict[str, Scheme]):
    """Schemes by name; a name that is not built in is looked up among methods of one's own.

    A designer becomes a scheme with the default estimator, an estimator one under random codes.
    """

    def __missing__(self, name: str) -> Scheme:
        thing = load_own(name)
        if isinstance(thing, Scheme):
            return thing
        return Scheme("random", estimator=name) if hasattr(thing, "step") else Scheme(name)


SCHEMES = Schemes(
    {
        "optimized": Scheme("spec"),
        "random": Scheme("random"),
        "exact": Scheme("exact"),
        "genie": Scheme("spec", on_truth=True),
        "no_ris": Scheme(None),
        "bp_slam": Scheme("random", estimator="bp_slam"),
        "bp_slam_aoa": Scheme("random", estimator="bp_slam_aoa"),
        "channel_slam": Scheme("random", estimator="channel_slam"),
        "bp_slam_no_ris": Scheme(None, estimator="bp_slam"),
        "bp_slam_aoa_no_ris": Scheme(None, estimator="bp_slam_aoa"),
        "channel_slam_no_ris": Scheme(None, estimator="channel_slam"),
    }
)
"""All built-in schemes by name, and those of one's own when they are asked for."""


def check_scheme(name: str) -> str:
    """The name, if it is a scheme's.

    Raises
    ------
    ValueError
        It is not; with the names that are.
    """
    if name in SCHEMES:
        return name
    if not is_own(name):
        hint = did_you_mean(nearest(name, SCHEMES))
        raise ValueError(f"{hint} give one of {', '.join(SCHEMES)}, or module:function of your own".lstrip())
    try:
        load_own(name)
    except ConfigError as error:
        raise ValueError(str(error)) from None
    return name
