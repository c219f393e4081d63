"""How long does the receiver take for one cycle of 0.1 s, and how does that grow with antennas and samples?

The paper's room with all classes of paths, at places along the track, one core. Prints processor time a cycle of the
bound-driven receivers, of the signal's synthesis and of the waveform estimator, for each size of array, bandwidth and
noise level; the estimator begins from nothing, and with what it found in the cycle before. Run:
`OMP_NUM_THREADS=1 python benchmarks/receiver/speed.py [--places 12]`.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import (
    ReceiverConfig,
    capture,
    find_components,
    init_tracks,
    measure,
    receive,
    step_tracks,
    with_reference_snr,
)
from rislam_rt.measurement.waveform_receiver import to_measurement
from rislam_rt.model import Paths, RadioConfig, RxArray, Trajectory
from rislam_rt.scene import load_scene

WAVEFORM = ReceiverConfig(estimator="waveform", alternation=False)
CASES = {
    "4 x 4, 1 GHz": RadioConfig(),
    "2 x 2": RadioConfig(array=RxArray(rows=2, cols=2)),
    "8 x 8": RadioConfig(array=RxArray(rows=8, cols=8)),
    "0.1 GHz": RadioConfig(bandwidth=0.1e9),
    "0.5 GHz": RadioConfig(bandwidth=0.5e9),
    "2 GHz": RadioConfig(bandwidth=2e9),
    "4 GHz": RadioConfig(bandwidth=4e9),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=12)
    parser.add_argument("--quick", action="store_true", help="only what is fast")
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    agent = scene.agent
    after = np.linspace(1, len(agent) - 1, arguments.places).astype(int)
    rows = np.concatenate([after, after - 1])  # the places, then the cycle before each
    motion = Trajectory(agent.time[rows], agent.position[rows], agent.velocity[rows], agent.heading[rows], agent.body)
    paths = ImageSourceChannel(scene, RadioConfig()).paths(motion)

    print("milliseconds of processor time a cycle: mean and largest over the places; samples L M; components found")
    base = RadioConfig()
    for name, config in (
        ("bound, cell", ReceiverConfig(estimator="bound", alternation=False)),
        ("bound, joint", ReceiverConfig(estimator="bound", resolution="joint", alternation=False)),
    ):
        print_times(name, times(lambda k, c=config: draw(paths, motion, k, base, c), arguments.places))
    if arguments.quick:
        return
    print_times("synthesis", times(lambda k: sound(paths, motion, k, base, WAVEFORM), arguments.places))
    for name, radio in CASES.items():
        print_case(f"waveform, {name}", paths, motion, radio, WAVEFORM)
    for snr in (0.0, 30.0):
        print_case(f"waveform, sphere at {snr:.0f} dB", paths, motion, with_reference_snr(base, snr), WAVEFORM)
    print_case("waveform, alternation", paths, motion, base, replace(WAVEFORM, alternation=True))
    print_case("waveform, element exact", paths, motion, base, replace(WAVEFORM, element_exact=True))
    print_times("tracking", track_times(paths, motion, base))


def draw(paths: Paths, motion: Trajectory, cycle: int, radio: RadioConfig, config: ReceiverConfig) -> Any:
    return measure(paths, cycle, float(motion.heading[cycle]), radio, config, rng=np.random.default_rng(cycle))


def sound(paths: Paths, motion: Trajectory, cycle: int, radio: RadioConfig, config: ReceiverConfig) -> Any:
    received = receive(paths, cycle, float(motion.heading[cycle]), radio, config)
    return capture(received, radio, config, rng=np.random.default_rng(cycle))


def times(work: Callable[[int], Any], places: int) -> list[float]:
    """Processor seconds of each place, the fastest of three."""
    work(0)
    best = []
    for place in range(places):
        runs = []
        for _ in range(3):
            begin = time.process_time()
            work(place)
            runs.append(time.process_time() - begin)
        best.append(min(runs))
    return best


def track_times(paths: Paths, motion: Trajectory, radio: RadioConfig) -> list[float]:
    state, seconds = init_tracks(), []
    for cycle in range(len(motion) // 2):
        measurement, _ = draw(paths, motion, cycle, radio, WAVEFORM)
        for _ in range(4):
            begin = time.process_time()
            state, _ = step_tracks(state, measurement, 0.1)
            seconds.append(time.process_time() - begin)
    return seconds


def print_case(name: str, paths: Paths, motion: Trajectory, radio: RadioConfig, config: ReceiverConfig) -> None:
    places = len(motion) // 2
    captures = [sound(paths, motion, cycle, radio, config) for cycle in range(2 * places)]
    before = [to_measurement(find_components(one, radio, config), radio, config) for one in captures[places:]]
    found = [len(find_components(one, radio, config).tau) for one in captures[:places]]
    spent = times(lambda k: find_components(captures[k], radio, config), places)
    print_times(name, spent, f"  {captures[0][0].samples.size:6d} samples, {np.mean(found):5.1f} components")
    print_times(
        "  from the cycle before", times(lambda k: find_components(captures[k], radio, config, before[k]), places)
    )


def print_times(name: str, seconds: list[float], note: str = "") -> None:
    print(f"{name:28s} {1e3 * np.mean(seconds):8.2f} {1e3 * np.max(seconds):8.2f}{note}")


if __name__ == "__main__":
    main()
