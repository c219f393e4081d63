"""What can any filter reach? The posterior bound of the paper's run against SNR, for each way to choose the codes.

SNR is that of the paper's sphere at 3 m, integrated over all antennas. Start and motion as given, landmarks and walls
unknown; a path is detected from 10 dB. Root mean square over the cycles, horizontal, in mm.
Run:
`python benchmarks/filter/posterior.py [--walls planes|images|known] [--acceleration 0.01] [--start 0.01] [--use-vt]`.
"""

import argparse
from dataclasses import replace

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.design import DESIGNERS, DesignConfig, problem_from_paths
from rislam_rt.information import MotionPrior, build_landmark_model, posterior_bound
from rislam_rt.model import PathKind, Paths, RadioConfig, RisCode, Scene
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene

SNR_DB = (-10, -5, 0, 5, 10, 20, 30)
DETECTION = 10.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--walls", choices=("known", "planes", "images"), default="planes")
    parser.add_argument("--acceleration", type=float, default=0.01)
    parser.add_argument("--start", type=float, default=0.01)
    parser.add_argument("--use-vt", action="store_true")
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    walls = build_walls(scene)
    motion = MotionPrior(arguments.acceleration, arguments.start, arguments.start)
    paths = ImageSourceChannel(scene, RadioConfig(), 1).paths(scene.agent)
    print(f"{'SNR dB':>8s}" + "".join(f"{name:>22s}" for name in cases(scene, paths, RadioConfig())))
    for decibel in SNR_DB:
        radio = replace(RadioConfig(), noise_psd=noise_for(10.0 ** (decibel / 10.0)))
        row = [
            rms(scene, case, walls, radio, motion, arguments.walls, arguments.use_vt)
            for case in cases(scene, paths, radio).values()
        ]
        print(f"{decibel:8d}" + "".join(f"{1e3 * value:22.1f}" for value in row))


def noise_for(snr: float) -> float:
    """N0 [W/Hz] at which a 5 cm sphere 3 m away has that SNR over all antennas."""
    radio = RadioConfig()
    gain = radio.wavelength * np.sqrt(np.pi) * 0.05 / ((4.0 * np.pi) ** 1.5 * 9.0)
    return float(radio.integrated_snr(np.array(gain)) * radio.noise_psd / snr)


def cases(scene: Scene, paths: Paths, radio: RadioConfig) -> dict[str, Paths]:
    """The genie's codes by several designs, random codes, and no panel."""
    assert scene.ris is not None
    spec, rng = scene.ris.spec, np.random.default_rng(2)
    tx, rx, prior = scene.agent.tx, scene.agent.rx, np.eye(2) / 0.05**2
    found = {}
    for name, method, least in (
        ("CRLB", "coordinate", 0.0), ("CRLB, detected paths", "coordinate", DETECTION), ("direct path", "exact", 0.0),
    ):  # fmt: skip
        index = []
        for cycle, child in enumerate(rng.spawn(paths.num_cycles)):
            problem = problem_from_paths(
                paths, tx[cycle], rx[cycle], radio, spec.levels, cycle=cycle, prior=prior, least_snr=least
            )
            index.append(DESIGNERS[method](problem, rng=child, config=DesignConfig(certify=False)).code.index)
        found[name] = rephase(paths, RisCode(np.array(index), spec.levels))
    drawn = RisCode(rng.integers(spec.levels, size=(paths.num_cycles, spec.rows, spec.cols)), spec.levels)
    found["random"] = rephase(paths, drawn)
    panel = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    found["no panel"] = paths.with_gain(np.where(panel, 0.0, paths.gain))
    return found


def rms(
    scene: Scene, paths: Paths, walls: Walls, radio: RadioConfig, motion: MotionPrior, mode: str, use_vt: bool
) -> float:
    """Root mean square over the cycles [m]."""
    model = build_landmark_model(
        paths, scene.agent, scene.landmark_positions, walls.normal, walls.offset, radio, walls=mode  # type: ignore[arg-type]
    )  # fmt: skip
    bound = posterior_bound(model.rows(DETECTION, use_vt=use_vt), scene.agent.time, motion, model.prior_std())
    return float(np.sqrt(np.mean(bound.rms**2)))


if __name__ == "__main__":
    main()
