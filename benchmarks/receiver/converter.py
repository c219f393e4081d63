"""How many bits do the converters need, with and without cancelling the leakage before them?

The paper's room at places along the track, sphere at 13 dB: share of scatterer and panel returns above 13 dB that the
waveform estimator finds, and the noise that the converters add, in dB over the receiver's own. Run:
`python benchmarks/receiver/converter.py [--places 20]`.
"""

import argparse

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, capture, measure, receive
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()
BITS = (6, 8, 10, 12, 14, 0)
CANCELLATIONS_DB = (0.0, 30.0, 60.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=20)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    rows = np.linspace(0, len(scene.agent) - 1, arguments.places).astype(int)
    agent = scene.agent
    motion = Trajectory(agent.time[rows], agent.position[rows], agent.velocity[rows], agent.heading[rows], agent.body)
    paths = ImageSourceChannel(scene, RADIO).paths(motion)
    print("bits, cancellation [dB]: converter noise over N0 [dB], landmark paths above 13 dB found")
    for cancellation in CANCELLATIONS_DB:
        for bits in BITS:
            config = ReceiverConfig(
                estimator="waveform", converter_bits=bits, leakage_cancellation_db=cancellation, false_alarm_rate=0.1,
                alternation=False,
            )  # fmt: skip
            extra, share = score(paths, motion, config)
            print(f"{bits or 'exact':>5}  {cancellation:4.0f}  {extra:6.1f}  {share:5.2f}")


def score(paths: Paths, motion: Trajectory, config: ReceiverConfig) -> tuple[float, float]:
    rng = np.random.default_rng(6)
    snr = 10.0 * np.log10(np.maximum(RADIO.integrated_snr(paths.gain), 1e-300))
    level, found = [], []
    for cycle in range(paths.num_cycles):
        heading = float(motion.heading[cycle])
        received = receive(paths, cycle, heading, RADIO, config)
        level.append(capture(received, RADIO, config, rng=rng)[0].noise_psd / RADIO.noise_psd - 1.0)
        _, truth = measure(paths, cycle, heading, RADIO, config, rng=rng)
        wanted = received.path[(paths.kind[received.path] >= PathKind.PS) & (snr[cycle, received.path] > 13.0)]
        found.append(np.isin(wanted, truth.path))
    return float(10.0 * np.log10(max(np.mean(level), 1e-30))), float(np.mean(np.concatenate(found)))


if __name__ == "__main__":
    main()
