"""Coverage of a panel, where it can be heard: SNR of its direct path under the best code, at the agent's height."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.adviser.budget import NOTHING_DB
from rislam_rt.adviser.codes import aimed_paths
from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement.received import HORIZON_MARGIN
from rislam_rt.model import PathKind, Scene, Trajectory
from rislam_rt.pipeline.specification.spec import Settings

POINTS, ELEMENTS = 6000, 2_000_000
"""Most points of a map, and most of points times elements: a second or two."""
INSIDE = 1e-3
"""[m] by which the outermost points lie within the bounds: on a wall nothing is heard."""


class Coverage(NamedTuple):
    """A map of one panel; Y by X points."""

    panel: str
    x: Floats
    """(X,) [m]."""
    y: Floats
    """(Y,) [m]."""
    height: float
    """[m] of the agent: the median over its way."""
    margin_db: Floats
    """(Y, X) SNR over the detection threshold; not a number where no direct path comes in."""

    @property
    def heard(self) -> float:
        """Share of the points with a direct path at which it is heard; zero if there is none."""
        seen = np.isfinite(self.margin_db)
        return float(np.mean(self.margin_db[seen] >= 0.0)) if seen.any() else 0.0


def panel_coverage(scene: Scene, settings: Settings) -> list[Coverage]:
    """Maps of coverage, one for each of a scene's panels."""
    if scene.ris is None:
        return []
    low, high = scene.bounds
    size = np.maximum(high - low, 4.0 * INSIDE)[:2]
    most = min(POINTS, ELEMENTS // scene.ris.spec.num_elements)
    step = float(np.sqrt(size[0] * size[1] / max(most, 16)))
    x, y = (
        np.linspace(low[axis] + INSIDE, high[axis] - INSIDE, max(int(size[axis] / step), 2) + 1) for axis in range(2)
    )
    height = float(np.median(scene.agent.position[:, 2]))
    xx, yy = np.meshgrid(x, y)
    points = np.column_stack([xx.ravel(), yy.ravel(), np.full(xx.size, height)])
    margins = _direct_margins(scene, points, settings)
    return [
        Coverage(panel.name, x, y, height, margin.reshape(xx.shape))
        for panel, margin in zip(scene.panels, margins, strict=True)
    ]


def _direct_margins(scene: Scene, points: Floats, settings: Settings) -> Floats:
    """Coverage (panels, N) [dB] of direct paths at points (N, 3), the agent headed along x."""
    assert scene.ris is not None
    count = len(points)
    still = Trajectory(
        np.arange(count, dtype=np.float64), points, np.zeros((count, 3)), np.zeros(count), scene.agent.body
    )
    alone = replace(scene, scatterers=tuple(s for s in scene.scatterers if s.shade is not None), agent=still)
    paths = ImageSourceChannel(alone, settings.radio, 0).paths(still)
    paths = aimed_paths(paths, scene.ris.spec, settings.radio)
    margin = np.full((len(scene.panels), count), np.nan)
    for path in np.flatnonzero(paths.kind == PathKind.RIS):
        heard = paths.valid[:, path]
        if settings.radio.array.pattern == "upper":
            heard = heard & (paths.arrival[:, path, 2] >= -HORIZON_MARGIN)
        snr = settings.radio.integrated_snr(paths.gain[:, path]) / settings.sensor.threshold
        margin[paths.panel[path], heard] = np.maximum(10.0 * np.log10(np.maximum(snr[heard], 1e-40)), NOTHING_DB)
    return margin
