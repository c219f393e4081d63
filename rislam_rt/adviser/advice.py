"""Advice on a room before a run: link budgets of its landmarks, remedies, and the cost of tracing."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.adviser.link_budget import NOTHING_DB, LandmarkLink, Survey, link_budget, survey
from rislam_rt.adviser.remedies import detection_label, remedies
from rislam_rt.adviser.tracing_cost import TraceCost, trace_cost
from rislam_rt.model import Scene
from rislam_rt.pipeline.specification.pipeline_spec import Settings


class Advice(NamedTuple):
    """Advice on a room, with the radio and receiver of its settings: link budgets, remedies, and costs of tracing."""

    links: list[LandmarkLink]
    remedies: list[str]
    """Lines that say what would help."""
    costs: list[TraceCost]
    threshold_db: float
    """Detection threshold [dB] of the SNR over all antennas."""

    def as_dict(self) -> dict[str, Any]:
        """Advice on a room as tables for JSON; a margin of None stands for no path."""
        links = []
        for link in self.links:
            margins = [float(margin) if margin > NOTHING_DB else None for margin in link.margin_db]
            places = [
                {"margin_db": margins[at], "probability": float(link.probability[at]), "reason": link.reason[at]}
                for at in link.three
            ]
            words = {
                "landmark": link.landmark, "code": link.code, "share": link.share, "verdict": detection_label(link),
            }  # fmt: skip
            links.append(words | dict(zip(("start", "middle", "end"), places, strict=True)))
        costs = [cost._asdict() for cost in self.costs]
        return {"threshold_db": self.threshold_db, "links": links, "remedies": self.remedies, "costs": costs}


def advise(scene: Scene, settings: Settings, *, rng: np.random.Generator, looked: Survey | None = None) -> Advice:
    """Forecast what a run would detect in a room that passes the scene check, what would help, and what tracing costs.
    `rng` draws the random codes that a RIS panel is tried under; `looked` is the survey of the room, where there is one
    already."""
    looked = looked or survey(scene, settings)
    links = link_budget(looked, rng=rng)
    threshold = 10.0 * float(np.log10(settings.sensor.threshold))
    return Advice(links, remedies(looked, links), trace_cost(scene, settings.radio, len(looked.paths.walls)), threshold)
