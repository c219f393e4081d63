"""What motion within the slot costs at the reference point of Fig. 4(b): optimised codes, 0 dB, the whole minute.

The same rooms, motions and noise with codes held for microseconds (nothing leaks), in the order A-B-B-A, in the order
A-B, and in that order with what is found in the difference taken for the panel's without asking. Run:
`python benchmarks/receiver/slot_reference.py [--seeds 20] [--snr 0] [--resolution cell]`; one line a seed, then the
medians.
"""

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from rislam_rt.measurement import bound_receiver
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.scene import load_scene

WAYS = {
    "10 us": ("receiver.code_dwell=1e-5",), "A-B-B-A": (), "A-B": ('receiver.order="AB"',),
    "A-B, taken for the panel's": ('receiver.order="AB"',),
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--snr", type=float, default=0.0)
    parser.add_argument("--cycles", type=int, default=600)
    parser.add_argument("--settings", nargs="*", default=[])
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    base = [
        'schemes=["optimized"]', "receiver.estimator=bound", 'channel="image_source"', "receiver.alternation=true",
        f"cycles={arguments.cycles}",
        f"radio.reference_snr_db={arguments.snr}", "motion.sigma_a_m_s2=0.01", *arguments.settings,
    ]  # fmt: skip
    table = []
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        row = []
        for name, words in WAYS.items():
            spec = load_spec("pipelines/trace_then_slam.toml", [*base, *words])
            begin = time.process_time()
            with taken_for_granted(name.endswith("panel's")):
                result = run_slam(scene, spec, rng=np.random.default_rng(seed))
            found = result.schemes["optimized"]
            error = found.position - result.scene.agent.position
            row.append(1e3 * float(np.sqrt(np.mean(np.sum(error**2, axis=1)))))
            seconds = time.process_time() - begin
        table.append(row)
        print(seed, np.round(row, 1), f"{seconds:.0f} s", flush=True)
    print("RMSE [mm]:", ", ".join(WAYS))
    print("median", np.round(np.median(table, axis=0), 1))
    print("mean  ", np.round(np.mean(table, axis=0), 1))
    print("root mean square", np.round(np.sqrt(np.mean(np.square(table), axis=0)), 1))


@contextmanager
def taken_for_granted(wanted: bool) -> Iterator[None]:
    """What is found in the difference is reported as the panel's for certain, as if nothing moved."""
    asked = bound_receiver.panel_probability
    if wanted:
        bound_receiver.panel_probability = lambda found, *_: (np.where(found.capture > 0, 1.0 - 1e-6, 1e-6), None)
    try:
        yield
    finally:
        bound_receiver.panel_probability = asked


if __name__ == "__main__":
    main()
