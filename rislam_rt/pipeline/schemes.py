"""The schemes that a run compares: each with or without the panel, with a code designer and an estimator."""

from typing import NamedTuple

from pydantic import ValidationInfo

from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import did_you_mean, nearest
from rislam_rt.pipeline.own_methods import is_own, load_own


class Scheme(NamedTuple):
    """Combination of code designer (or no panel) and estimator; motion, channel and noise are the same for all."""

    method: str | None
    """Name of a designer; `spec`: the one that the pipeline names; None: a plain wall in the panel's place."""
    on_truth: bool = False
    """Whether codes are designed on the true paths: the genie, a reference that no agent can reach."""
    estimator: str = "slam"
    """Name in `pipeline.estimators.ESTIMATORS`."""

    @property
    def panel(self) -> bool:
        """Whether the scheme uses the RIS panel."""
        return self.method is not None


class Schemes(dict[str, Scheme]):
    """Schemes by name; a name that is not built in is loaded as a user's own method (`module:attribute`).

    A designer becomes a scheme with the default estimator, an estimator one with random codes.
    """

    def __missing__(self, name: str) -> Scheme:
        thing = load_own(name)
        if isinstance(thing, Scheme):
            return thing
        return Scheme("random", estimator=name) if hasattr(thing, "step") else Scheme(name)


PUBLISHED = ("bp_slam", "bp_slam_aoa", "channel_slam")
"""Names of the other published estimators, each with random codes and without a panel."""
SCHEMES = Schemes(
    {
        "optimized": Scheme("spec"),
        "random": Scheme("random"),
        "exact": Scheme("exact"),
        "genie": Scheme("spec", on_truth=True),
        "no_ris": Scheme(None),
        **{name: Scheme("random", estimator=name) for name in PUBLISHED},
        **{f"{name}_no_ris": Scheme(None, estimator=name) for name in PUBLISHED},
    }
)
"""Built-in schemes by name; a user's own are loaded when they are asked for."""


STORED = "stored"
"""Context of a validation in which methods of a user's own are not loaded, as they need not be there."""


def check_scheme(name: str, info: ValidationInfo) -> str:
    """Return `name` if it is that of a built-in scheme or of a user's own method.

    Raises
    ------
    ValueError
        It is not; the message lists the built-in ones.
    """
    if name in SCHEMES or info.context == STORED:
        return name
    if not is_own(name):
        hint = did_you_mean(nearest(name, SCHEMES))
        raise ValueError(f"{hint} give one of {', '.join(SCHEMES)}, or module:function of your own".lstrip())
    try:
        load_own(name)
    except ConfigError as error:
        raise ValueError(str(error)) from None
    return name
