"""Do components keep their labels while the agent walks?

The paper's track, labels of the tracker against the true identities: share of components with the label of their path,
switches of label, and how long labels live, for both estimators. Run:
`python benchmarks/receiver/tracks.py [--cycles 600]`.
"""

import argparse

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.evaluate import association_score
from rislam_rt.measurement import ReceiverConfig, init_tracks, measure, step_tracks
from rislam_rt.measurement.tracking import CONFIRM_HITS
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.scene import load_scene

RADIO = RadioConfig()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=600)
    arguments = parser.parse_args()
    scene = load_scene("scenes/paper_room")
    motion = scene.agent[: arguments.cycles]
    paths = ImageSourceChannel(scene, RADIO).paths(motion)
    for config in (ReceiverConfig("bound", alternation=False), ReceiverConfig(alternation=False)):
        rng = np.random.default_rng(2)
        state, label, truth, confirmed, measurement = init_tracks(), [], [], [], None
        for cycle in range(len(motion)):
            heading = float(motion.heading[cycle])
            measurement, known = measure(paths, cycle, heading, RADIO, config, measurement, rng=rng)
            state, now = step_tracks(state, measurement, 0.1)
            label.append(now)
            truth.append(known.path)
            confirmed.append(np.isin(now, state.label[state.hits >= CONFIRM_HITS]))
        all_labels, path, sure = (np.concatenate(rows) for rows in (label, truth, confirmed))
        print(f"{config.estimator}: {len(path)} components, {len(np.unique(all_labels[sure]))} confirmed labels")
        print(f"  clutter in confirmed tracks: {np.mean(path[sure] < 0):.3f}")
        for kind in PathKind:
            mine = np.isin(path, np.flatnonzero(paths.kind == kind)) & sure
            if mine.sum() > 50:
                score = association_score(all_labels[mine], path[mine])
                purity = np.mean([_purity(all_labels, path, one) for one in np.unique(all_labels[mine])])
                rate = _switches(all_labels[mine], path[mine]) / mine.sum()
                print(f"  {kind.name:5s} {mine.sum():6d}: right {score.accuracy:.3f}, switches {rate:.4f}", end="")
                print(f", purity {purity:.3f}")


def _switches(label: np.ndarray, path: np.ndarray) -> int:
    """Number of times that the label of a path's components changes."""
    own = [label[path == one] for one in np.unique(path)]
    return sum(int(np.sum(labels[1:] != labels[:-1])) for labels in own)


def _purity(label: np.ndarray, path: np.ndarray, one: int) -> float:
    """Share of a label's components that belong to its commonest path."""
    _, counts = np.unique(path[label == one], return_counts=True)
    return float(counts.max() / counts.sum())


if __name__ == "__main__":
    main()
