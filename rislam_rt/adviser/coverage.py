"""Coverage of a RIS panel: SNR of its direct path under the best code all over the plan at the agent's height."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.adviser.forecast_codes import aimed_paths
from rislam_rt.adviser.link_budget import NOTHING_DB
from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement.received_paths import HORIZON_MARGIN
from rislam_rt.model import PathKind, Scene, Trajectory
from rislam_rt.pipeline.specification.pipeline_spec import Settings

POINTS, ELEMENTS = 6000, 2_000_000
"""Most positions of a coverage map, and most of positions times RIS elements: a second or two."""
INSIDE = 1e-3
"""[m] by which the outermost positions of a coverage map lie within the bounds: on a wall nothing is received."""


class Coverage(NamedTuple):
    """Coverage map of one RIS panel: margin over the detection threshold at Y by X positions of the plan."""

    panel: str
    """Name of the panel."""
    x: Floats
    """(X,) [m] coordinates along x."""
    y: Floats
    """(Y,) [m] coordinates along y."""
    height: float
    """Height [m] of the agent: the median over its trajectory."""
    margin_db: Floats
    """(Y, X) SNR over the detection threshold [dB]; not a number where no direct path comes in."""

    @property
    def heard(self) -> float:
        """Share of a coverage map's positions with a direct path where it exceeds the threshold; 0 without any."""
        seen = np.isfinite(self.margin_db)
        return float(np.mean(self.margin_db[seen] >= 0.0)) if seen.any() else 0.0


def panel_coverage(scene: Scene, settings: Settings) -> list[Coverage]:
    """Coverage maps of a scene's RIS panels, one for each; none in a room without a panel."""
    if scene.ris is None:
        return []
    radio = settings.radio
    low, high = scene.bounds
    size = np.maximum(high - low, 4.0 * INSIDE)[:2]
    most = min(POINTS, ELEMENTS // scene.ris.spec.num_elements)
    step = float(np.sqrt(size[0] * size[1] / max(most, 16)))
    count = np.maximum((size / step).astype(int), 2) + 1
    x, y = (np.linspace(low[axis] + INSIDE, high[axis] - INSIDE, count[axis]) for axis in range(2))
    height = float(np.median(scene.agent.position[:, 2]))
    xx, yy = np.meshgrid(x, y)
    points = np.column_stack([xx.ravel(), yy.ravel(), np.full(xx.size, height)])
    time = np.arange(xx.size, dtype=np.float64)
    still = Trajectory(time, points, np.zeros((xx.size, 3)), np.zeros(xx.size), scene.agent.body)
    alone = replace(scene, scatterers=tuple(s for s in scene.scatterers if s.shade is not None), agent=still)
    paths = aimed_paths(ImageSourceChannel(alone, radio, 0).paths(still), scene.ris.spec, radio)
    margin = np.full((len(scene.panels), xx.size), np.nan)
    for path in np.flatnonzero(paths.kind == PathKind.RIS):
        heard = paths.valid[:, path] & radio.array.receives(paths.arrival[:, path, 2], HORIZON_MARGIN)
        snr = radio.integrated_snr(paths.gain[:, path]) / settings.sensor.threshold
        margin[paths.panel[path], heard] = np.maximum(10.0 * np.log10(np.maximum(snr[heard], 1e-40)), NOTHING_DB)
    margins = margin.reshape(-1, *xx.shape)
    return [Coverage(panel.name, x, y, height, own) for panel, own in zip(scene.panels, margins, strict=True)]
