"""The adviser's whole word on a room: links, what would help, and what a trace costs."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.adviser.budget import NOTHING_DB, LandmarkLink, link_budget, survey
from rislam_rt.adviser.cost import TraceCost, trace_cost
from rislam_rt.adviser.remedies import detection_label, remedies
from rislam_rt.model import Scene
from rislam_rt.pipeline.specification.spec import Settings


class Advice(NamedTuple):
    """What is to be expected of a run in a room, with the radio and receiver of `settings`."""

    links: list[LandmarkLink]
    remedies: list[str]
    costs: list[TraceCost]
    threshold_db: float
    """Of detection: SNR over all antennas."""

    def as_dict(self) -> dict[str, Any]:
        """Advice for a machine to read; None stands for no path."""
        links = []
        for link in self.links:
            places = [
                {"margin_db": _finite(link.margin_db[at]), "probability": float(link.probability[at]),
                 "reason": link.reason[at]} for at in link.three
            ]  # fmt: skip
            words = {
                "landmark": link.landmark,
                "code": link.code,
                "share": link.share,
                "verdict": detection_label(link),
            }
            links.append(words | dict(zip(("start", "middle", "end"), places, strict=True)))
        costs = [cost._asdict() for cost in self.costs]
        return {"threshold_db": self.threshold_db, "links": links, "remedies": self.remedies, "costs": costs}


def advise(scene: Scene, settings: Settings, *, rng: np.random.Generator) -> Advice:
    """Advice on a room that passes the check. `rng` draws the random codes that a panel is tried under."""
    looked = survey(scene, settings)
    links = link_budget(looked, rng=rng)
    threshold = 10.0 * float(np.log10(settings.sensor.threshold))
    return Advice(links, remedies(looked, links), trace_cost(scene, settings.radio, len(looked.paths.walls)), threshold)


def _finite(margin: float) -> float | None:
    return float(margin) if margin > NOTHING_DB else None
