"""Into how many facets may a round room be cut before the filter is lost in it? Over rooms and straight ways.

`python benchmarks/filter/round_rooms.py --runs 8` draws, for each number of facets, round rooms of 3.5 to 6.5 m radius
without panel and scatterers, and straight ways of 10 s at 0.3 to 0.8 m/s up to 0.6 of the radius off the middle, half
of them from rest; image sources, 13 dB. Errors are relative to the start; lost is a run that errs by more than 0.1 m
RMS. The last row draws the number as well, twice as many times.
"""

import argparse
from dataclasses import replace

import numpy as np

from rislam_rt import slam
from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.evaluate import root_mean_square
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import Material, RadioConfig, Reflector, Scene, SensorModel, Trajectory
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_room
from rislam_rt.slam import SlamConfig, StartPrior

HEIGHT, CYCLES, STEP, REST, LOST = 3.2, 100, 0.1, 8, 0.1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--facets", type=int, nargs="*", default=[6, 8, 10, 12, 14, 16, 18, 20])
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--first", type=int, default=1020, help="seed of the first run")
    options = parser.parse_args()
    print("| facets | turn [deg] | lost of | median error [m] | errors [m] |\n|" + " --- |" * 5)
    for facets in [*options.facets, None]:
        errors = np.array([run(options.first + k, facets) for k in range(options.runs * (1 + (facets is None)))])
        turn = f"{360.0 / facets:.3g}" if facets else "8 to 18"
        shown = ", ".join(f"{error:.3f}" for error in errors)
        lost = f"{int(np.sum(errors > LOST))} of {len(errors)}"
        print(f"| {facets or '20 to 43'} | {turn} | {lost} | {np.median(errors):.4f} | {shown} |", flush=True)


def run(seed: int, facets: int | None) -> float:
    """RMSE [m] relative to the start of one run in a round room drawn from its seed; `facets` None: drawn as well."""
    rng = np.random.default_rng(seed)
    radius, drawn = rng.uniform(3.5, 6.5), int(rng.integers(20, 44))
    motion = way(radius, rng)
    radio, config = with_reference_snr(RadioConfig(), 13.0), SlamConfig()
    scene = round_room(radius, facets or drawn, motion)
    paths = ImageSourceChannel(scene, radio, 2).paths(motion)
    noise, heading = np.random.default_rng(seed - 1000), motion.heading
    told = motion.velocity[0] + 0.01 * noise.standard_normal(3) * [1.0, 1.0, 0.0]
    start = StartPrior(motion.position[0], told, float(heading[0]))
    state = slam.init(start, motion.body, None, SensorModel(radio), config, rng=noise)
    errors = np.empty(CYCLES)
    for cycle in range(CYCLES):
        heard, _ = measure(paths, cycle, heading[cycle], radio, ReceiverConfig("bound", alternation=False), rng=noise)
        state, _ = slam.step(state, heard, None, STEP if cycle else 0.0, heading[cycle], config, rng=noise)
        errors[cycle] = np.linalg.norm(slam.estimate(state, config).position - motion.position[cycle])
    return root_mean_square(errors)


def way(radius: float, rng: np.random.Generator) -> Trajectory:
    """Straight way of 10 s, whose middle lies beside that of the room, by a drawn speed, heading and offset; half of
    all set off from rest after `REST` cycles, by 0.5 m/s^2."""
    speed, heading, rests = rng.uniform(0.3, 0.8), rng.uniform(-np.pi, np.pi), bool(rng.choice([0, 1]))
    pace = np.full(CYCLES, speed)
    if rests:
        pace = np.clip(0.5 * STEP * (np.arange(CYCLES) - REST), 0.0, speed)
    gone = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (pace[1:] + pace[:-1]))])
    ahead, aside = np.array([np.cos(heading), np.sin(heading), 0.0]), np.array([-np.sin(heading), np.cos(heading), 0.0])
    place = rng.uniform(-0.6, 0.6) * radius * aside + np.outer(gone - 0.5 * gone[-1], ahead) + [0.0, 0.0, 1.2]
    agent = load_scene(find_room("paper_room")).agent[:CYCLES]
    return replace(agent, position=place, velocity=np.outer(pace, ahead), heading=np.full(CYCLES, heading))


def round_room(radius: float, facets: int, motion: Trajectory) -> Scene:
    """Scene of a round room of so many facets, with a flat floor and ceiling, in which an agent moves."""
    turn = 0.03 + 2.0 * np.pi * np.arange(facets) / facets
    foot = radius * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(facets)])
    head = foot + np.array([0.0, 0.0, HEIGHT])
    parts = {f"facet_{k}": np.array([foot[k], head[k], head[k - 1], foot[k - 1]]) for k in range(facets)}
    reflectors = tuple(
        polygon(name, corners) for name, corners in {**parts, "floor": foot, "ceiling": head[::-1]}.items()
    )
    return Scene("round", reflectors, (), None, motion)


def polygon(name: str, corners: Floats) -> Reflector:
    """Reflector of a convex polygon (N, 3) [m]."""
    fan = np.array([[0, k, k + 1] for k in range(1, len(corners) - 1)])
    return Reflector(name, corners, fan, Material(reflection=0.7))


if __name__ == "__main__":
    main()
