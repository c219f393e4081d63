"""What could any scheme of delays alone reach, that holds every path as a feature of its own? Posterior bound.

The paper's room, image sources, random codes. Unknown of a path: the point that both ends see, or, of a path over a
wall and a scatterer, both points; of a wall return, the planes that it meets. No two paths share an unknown, so that
nothing ties a path to its reciprocal. Errors along and across the walk as it was told to the agent, root mean square
over the cycles, for delays as exact as they are reported and for a least standard deviation of 3 mm (that of the
rivals). The bound is linearised at the true motion, so that it holds the side to which the course bends for known; no
scheme can know it, and the spread across of a scheme is that of dead reckoning (last column).
Run: `python benchmarks/filter/delay_bound.py [--seeds 3] [--first 0] [--snr 0 10 30] [--cycles 360]`.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import mirror_chain
from rislam_rt.information import (
    LinearMeasurements,
    MotionPrior,
    build_landmark_model,
    fewer_rows,
    heard_paths,
    posterior_bound,
)
from rislam_rt.information.heard_paths import SILENT
from rislam_rt.information.landmark_model import LandmarkModel
from rislam_rt.information.position_bound import range_information
from rislam_rt.measurement import build_sensor
from rislam_rt.model import PathKind, SlamResult
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import run_slam
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
PLACE_STD, TILT_STD = 200.0, 10.0
"""Of an unknown point or offset [m], and of an unknown tilt [rad], beforehand: so wide that no direction is told."""


class Columns:
    """Unknowns of each path in turn."""

    def __init__(self, model: LandmarkModel) -> None:
        paths = model.paths
        self.first = np.zeros(paths.num_paths, dtype=np.int64)
        self.std: list[float] = []
        for path in range(paths.num_paths):
            self.first[path] = len(self.std)
            if paths.kind[path] == PathKind.VT:
                self.std += [TILT_STD, TILT_STD, PLACE_STD] * int((paths.tx_walls[path] >= 0).sum())
            else:
                self.std += [PLACE_STD] * (3 if model.tx_point[path] == model.rx_point[path] else 6)


def rows_of(model: LandmarkModel, columns: Columns, least_snr: float, least_std: float) -> Iterator[LinearMeasurements]:
    """Ranges of each cycle."""
    for cycle in range(model.paths.num_cycles):
        snr = model.radio.integrated_snr(model.paths.gain[cycle])
        heard = np.flatnonzero(model.paths.valid[cycle] & (snr >= least_snr))
        agent, unknown = np.zeros((len(heard), 3)), np.zeros((len(heard), len(columns.std)))
        for row, path in enumerate(heard):
            agent[row], slope = one_range(model, cycle, int(path))
            unknown[row, columns.first[path] : columns.first[path] + len(slope)] = slope
        information = range_information(snr[heard], model.radio)
        yield fewer_rows(LinearMeasurements(agent, unknown, 1.0 / (1.0 / information + least_std**2)))


def one_range(model: LandmarkModel, cycle: int, path: int) -> tuple[Floats, Floats]:
    """Derivatives of a path's length by the agent (3,) and by its own unknowns."""
    tx, rx = model.motion.tx[cycle], model.motion.rx[cycle]
    if model.paths.kind[path] != PathKind.VT:
        first, last = model.tx_point[path], model.rx_point[path]
        out, back = unit(tx - model.point[first]), unit(rx - model.point[last])
        return out + back, -(out + back) if first == last else -np.concatenate([out, back])
    walls = model.paths.tx_walls[path][model.paths.tx_walls[path] >= 0]
    chain = mirror_chain(tx, model.wall_normal[walls], model.wall_offset[walls])
    toward = unit(chain.image - rx)
    slopes = np.moveaxis(np.asarray(chain.planes), -3, 0)
    return toward @ (chain.linear - np.eye(3)), np.concatenate([toward @ slope for slope in slopes])


def bound(result: SlamResult, least_std: float) -> tuple[float, float]:
    """Root mean squares along and across the walk as it was told [m]."""
    spec = PipelineSpec.model_validate(dict(result.config))
    settings, found = build_settings(spec), result.schemes["bp_slam"]
    sensor = build_sensor(settings.radio, settings.receiver)
    paths = heard_paths(result.paths.with_gain(found.gain), sensor, use_vt=True)
    walls = build_walls(result.scene)
    model = build_landmark_model(
        paths, result.scene.agent, result.scene.landmark_positions, walls.normal, walls.offset, settings.radio,
        walls="images",
    )  # fmt: skip
    columns = Columns(model)
    motion = MotionPrior(settings.bp_slam.sigma_a, spec.start.position_std_m, spec.start.velocity_std_m_s, 2)
    rows = rows_of(model, columns, SILENT * sensor.threshold, least_std)
    covariance = posterior_bound(rows, result.scene.agent.time, motion, np.array(columns.std)).agent[:, :2, :2]
    ahead = unit(found.velocity[0][:2])
    axes = np.array([ahead, [-ahead[1], ahead[0]]])
    along, across = np.sqrt(np.mean(np.einsum("ai,kij,aj->ka", axes, covariance, axes), axis=0))
    return float(along), float(across)


def main() -> None:
    """One row an SNR."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--snr", type=float, nargs="+", default=[0.0, 10.0, 30.0])
    parser.add_argument("--cycles", type=int, default=360)
    arguments = parser.parse_args()
    print("| SNR [dB] | along, across [m] | the same, 3 mm at least [m] | reckoned across [m] |\n" + "| --- " * 4 + "|")
    for snr in arguments.snr:
        told = (
            "receiver.estimator=bound", "receiver.alternation=false", "channel=image_source",
            "motion.sigma_a_m_s2=0.01", f"cycles={arguments.cycles}",
        )  # fmt: skip
        spec = load_spec(
            ROOT / "pipelines" / "trace_then_slam.toml", (*told, f"radio.reference_snr_db={snr}", 'schemes=["bp_slam"]')
        )
        found = []
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            scene = load_scene(ROOT / "scenes" / "paper_room")
            result = run_slam(scene, spec, rng=np.random.default_rng([20, seed]))
            found.append((*bound(result, 0.0), *bound(result, 0.003)))
        rms = np.sqrt(np.mean(np.square(found), axis=0))
        time = result.scene.agent.time - result.scene.agent.time[0]
        steps = np.arange(len(time))
        drift = 0.01 * (time[1] - time[0]) ** 2 * np.sqrt(np.cumsum((steps - 0.5).clip(0.0) ** 2))
        reckoned = np.sqrt(np.mean(0.01**2 + (0.01 * time) ** 2 + drift**2))
        print(f"| {snr:g} | {rms[0]:.3f}, {rms[1]:.3f} | {rms[2]:.3f}, {rms[3]:.3f} | {reckoned:.3f} |", flush=True)


if __name__ == "__main__":
    main()
