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
    low, high = scene.bounds
    size = np.maximum(high - low, 4.0 * INSIDE)[:2]
    most = min(POINTS, ELEMENTS // scene.ris.spec.num_elements)
    step = float(np.sqrt(size[0] * size[1] / max(most, 16)))
    count = np.maximum((size / step).astype(int), 2) + 1
    x, y = (np.linspace(low[axis] + INSIDE, high[axis] - INSIDE, count[axis]) for axis in range(2))
    height = float(np.median(scene.agent.position[:, 2]))
    xx, yy = np.meshgrid(x, y)
    points = np.column_stack([xx.ravel(), yy.ravel(), np.full(xx.size, height)])
    margins = _direct_margins(scene, points, settings)
    return [
        Coverage(panel.name, x, y, height, margin.reshape(xx.shape))
        for panel, margin in zip(scene.panels, margins, strict=True)
    ]


def _direct_margins(scene: Scene, points: Floats, settings: Settings) -> Floats:
    """Coverage (panels, N): margin [dB] of each RIS panel's direct path under the best code, at places (N, 3) [m]."""
    assert scene.ris is not None
    count = len(points)
    time = np.arange(count, dtype=np.float64)
    still = Trajectory(time, points, np.zeros((count, 3)), np.zeros(count), scene.agent.body)
    alone = replace(scene, scatterers=tuple(s for s in scene.scatterers if s.shade is not None), agent=still)
    paths = ImageSourceChannel(alone, settings.radio, 0).paths(still)
    paths = aimed_paths(paths, scene.ris.spec, settings.radio)
    margin = np.full((len(scene.panels), count), np.nan)
    for path in np.flatnonzero(paths.kind == PathKind.RIS):
        heard = paths.valid[:, path] & settings.radio.array.receives(paths.arrival[:, path, 2], HORIZON_MARGIN)
        snr = settings.radio.integrated_snr(paths.gain[:, path]) / settings.sensor.threshold
        margin[paths.panel[path], heard] = np.maximum(10.0 * np.log10(np.maximum(snr[heard], 1e-40)), NOTHING_DB)
    return margin
