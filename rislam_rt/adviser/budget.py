"""Link budget: how strong each landmark comes in along the way, how often it will be heard, and why not."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.adviser.codes import codes_of, paths_under_codes
from rislam_rt.adviser.detection import DetectionForecast, forecast_detection
from rislam_rt.adviser.reasons import Reasons, build_reasons
from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Paths, Scene
from rislam_rt.pipeline.specification.spec import Settings

PLACES = 15
"""Places along the way, evenly; the first, the middle and the last are the budget's three columns."""
DEPTHS = ((500, 2), (2000, 1))
"""Up to so many triangles, paths of so many wall bounces are looked at, and of more triangles the straight ones alone:
the check is to take seconds. More bounces are seldom the strongest; they cover weaker paths."""
NOTHING_DB = -400.0
"""SNR over the threshold [dB] where there is no path."""


class LandmarkLink(NamedTuple):
    """One landmark under one kind of codes, at K places."""

    landmark: str
    code: str
    """`aimed`, `swept` or `random` for a panel, empty for a scatterer."""
    margin_db: Floats
    """(K,) SNR of the strongest path over the detection threshold; of swept codes, that of the best beam, of random
    ones, the mean power's."""
    probability: Floats
    """(K,) that the receiver reports at least one component of it."""
    reason: tuple[str, ...]
    """(K,) why it is not heard there; empty where it is."""

    @property
    def share(self) -> float:
        """Share of the way on which a landmark's link is heard, by its budget."""
        return float(np.mean(self.probability))

    @property
    def three(self) -> tuple[int, int, int]:
        """Start, middle and end among the places of a link budget."""
        last = len(self.margin_db) - 1
        return 0, last // 2, last


class Survey(NamedTuple):
    """The paths of a room at places along the way."""

    scene: Scene
    """With the places for its trajectory."""
    paths: Paths
    settings: Settings
    depth: int
    """Wall bounces of the paths that were looked for."""


def survey(scene: Scene, settings: Settings, places: int = PLACES) -> Survey:
    """Paths for the link budget at places along the way, by exact image sources."""
    rows = np.unique(np.linspace(0, len(scene.agent) - 1, places).round().astype(np.int64))
    scene = replace(scene, agent=scene.agent[rows])
    faces = sum(len(reflector.faces) for reflector in scene.reflectors)
    channel = ImageSourceChannel(scene, settings.radio, next((depth for most, depth in DEPTHS if faces <= most), 0))
    return Survey(scene, channel.paths(scene.agent), settings, channel.depth)


def link_budget(looked: Survey, *, rng: np.random.Generator) -> list[LandmarkLink]:
    """A link for each scatterer, and one for each kind of codes of each panel. `rng` draws the random codes."""
    scene, paths, settings = looked.scene, looked.paths, looked.settings
    reasons = build_reasons(scene, paths, settings)
    if scene.ris is None:
        return [_link(name, "", [_all_places(paths, looked)], reasons, n) for n, name in enumerate(scene.landmarks)]
    links: list[LandmarkLink] = []
    for codes in codes_of(paths, scene.ris.spec, settings.radio, rng=rng):
        heard = [_all_places(paths_under_codes(paths, scene.ris.spec, levels), looked) for levels in codes.levels]
        if codes.name == "aimed":
            links += [_link(s.name, "", heard, reasons, n) for n, s in enumerate(scene.scatterers)]
        links += [
            _link(panel.name, codes.name, heard, reasons, len(scene.scatterers) + number)
            for number, panel in enumerate(scene.panels)
        ]
    return links


def _all_places(paths: Paths, looked: Survey) -> list[DetectionForecast]:
    heading = looked.scene.agent.heading
    return [
        forecast_detection(paths, place, float(heading[place]), looked.settings) for place in range(paths.num_cycles)
    ]


def _link(name: str, code: str, heard: list[list[DetectionForecast]], reasons: Reasons, number: int) -> LandmarkLink:
    """Link budget over C codes: mean of the chance, and of the power, but of swept codes the best beam's."""
    snr = np.array([[place.snr[number] for place in places] for places in heard])
    chance = np.array([[place.probability[number] for place in places] for places in heard]).mean(axis=0)
    level = snr.max(axis=0) if code == "swept" else snr.mean(axis=0)
    margin = 10.0 * np.log10(np.maximum(level / reasons.settings.sensor.threshold, 10.0 ** (NOTHING_DB / 10.0)))
    covered = np.array([place.covered[number] for place in heard[0]])
    said = tuple(
        "" if chance[place] > 0.5 else reasons.why(number, place, float(margin[place]), int(covered[place]))
        for place in range(len(margin))
    )
    return LandmarkLink(name, code, margin, chance, said)
