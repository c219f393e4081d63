"""Forecast cost of tracing a room with one to three wall bounces: wall sequences, paths, and seconds."""

from typing import NamedTuple

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.leg_candidates import wall_sequences
from rislam_rt.model import RadioConfig, Scene

DEPTHS = (1, 2, 3)
"""Numbers of wall bounces for which the cost is forecast."""
START_SECONDS, PATH_SECONDS, SEQUENCE_SECONDS = 0.15, 1.5e-6, 2.5e-8
"""Processor time [s] of the traced channel: of any trace, of one path in one cycle, and of one wall sequence that is
tested in one cycle. Measured on six rooms that come with the package (600 cycles, one core of a 2026 server):
`benchmarks/runs/adviser.py --cost` sets them beside new ones. The tracer's import comes on top, and so does the
filter."""
MANY_WALLS = 2000
"""Most walls of a room whose wall sequences are counted for the cost: the check is to take seconds."""
COUNTED = 300_000
"""Most wall sequences of one leg that are counted for the cost; the tracer takes about as many one by one, and narrows
more of them down by cones, at a cost that these rates do not tell."""


class TraceCost(NamedTuple):
    """Forecast cost of tracing the whole trajectory with up to `depth` wall bounces."""

    depth: int
    walls: int
    sequences: int
    """Wall sequences of all legs at the middle of the trajectory; an upper limit where there are no seconds."""
    paths: int | None
    """Paths at the middle of the trajectory; None where there were too many sequences to find them."""
    seconds: float | None
    """Processor time [s], or None likewise."""


def trace_cost(scene: Scene, radio: RadioConfig, walls: int) -> list[TraceCost]:
    """Forecast the cost of tracing a scene with a given number of walls, at each of `DEPTHS` wall bounces."""
    middle = scene.agent[len(scene.agent) // 2 :][:1]
    legs = 1 + 2 * len(scene.landmarks)
    costs: list[TraceCost] = []
    for depth in DEPTHS:
        most = sum(walls * max(walls - 1, 0) ** (bounces - 1) for bounces in range(1, depth + 1))
        if most > COUNTED or walls > MANY_WALLS:
            costs.append(TraceCost(depth, walls, legs * most, None, None))
            continue
        channel = ImageSourceChannel(scene, radio, depth)
        sequences, paths = _count_sequences(channel, depth), int(channel.paths(middle).valid.sum())
        seconds = START_SECONDS + len(scene.agent) * (PATH_SECONDS * paths + SEQUENCE_SECONDS * sequences)
        costs.append(TraceCost(depth, walls, sequences, paths, seconds))
    return costs


def cost_words(cost: TraceCost) -> str:
    """Forecast cost of tracing in words: `2 bounces: 173 wall sequences, 172 paths, 0.31 s`."""
    bounces = f"{cost.depth} bounce{'s' if cost.depth > 1 else ''}"
    if cost.seconds is None:
        digits = int(np.ceil(np.log10(max(cost.sequences, 1))))
        return f"{bounces}: up to 10^{digits} wall sequences, narrowed down before they are traced: no estimate"
    return f"{bounces}: {cost.sequences} wall sequences, {cost.paths} paths at a time, {cost.seconds:.2g} s"


def _count_sequences(channel: ImageSourceChannel, depth: int) -> int:
    """What tracing costs: number of wall sequences, empty ones included, to test at the trajectory's middle."""
    scene, facets, row = channel.scene, channel.sequence_search.facets, len(channel.scene.agent) // 2
    tx, rx = (ends[row : row + 1] for ends in (scene.agent.tx, scene.agent.rx))
    legs = [(tx, rx, -1)]
    for number, point in enumerate(scene.landmark_positions):
        panel = scene.panel_number(number)
        host = channel.walls.hosts[panel] if panel >= 0 else -1
        legs += [(tx, point[None], host), (rx, point[None], host)]
    return sum(1 + sum(len(block) for block in wall_sequences(facets, a, b, depth, host)) for a, b, host in legs)
