"""Tally of a long run's scores, summed slice by slice: equal to the scores of the whole run, without posterior bound.

The bound is a recursion over all cycles in which every path that is ever detected has unknowns; it is None here.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import AssociationScore, association_fractions, position_errors
from rislam_rt.model import NOTHING, STEPS, Scene
from rislam_rt.pipeline.long.slices import SlicePart
from rislam_rt.pipeline.scores.component_sources import path_sources, true_planes
from rislam_rt.pipeline.scores.loss_causes import LossTally
from rislam_rt.pipeline.scores.summary import (
    first_time,
    has_diverged,
    landmark_track,
    map_score,
    nees_per_dof,
    over_budget,
    panel_track,
    relative_errors,
)
from rislam_rt.pipeline.scores.wall_scores import count_ghosts, found_walls, wall_scores

CLUTTER = None


class Tally:
    """Running sums for the scores of one scheme of a long run, whose estimator maps wall returns or not (`use_vt`)."""

    def __init__(self, scene: Scene, budget: Any, *, use_vt: bool) -> None:
        self.scene, self.budget, self.use_vt = scene, budget, use_vt
        self.planes = true_planes(scene)
        self.cycles, self.square, self.largest, self.final = 0, 0.0, 0.0, 0.0
        self.relative: float | None = 0.0
        self.begin: Floats | None = None
        self.diverged = False
        self.nees: float | None = 0.0
        self.outcomes: Counter[str] = Counter()
        self.lost, self.start = LossTally(), 0.0
        self.pairs: Counter[tuple[int, Any]] = Counter()
        self.seconds = np.zeros(len(STEPS))
        count = len(scene.landmarks)
        self.landmark_square, self.held, self.identified = np.zeros(count), np.zeros(count, int), np.zeros(count, int)
        self.landmark_final, self.identified_last = np.full(count, np.nan), np.zeros(count, bool)
        self.identified_from: dict[int, float] = {}
        self.overlap = _Overlap()
        self.map: Any = None
        self.panel = False

    def counting(self, parts: Iterable[SlicePart]) -> Iterator[SlicePart]:
        """Yield the slices of a long run unchanged, adding each to the sums, so that its files are read only once."""
        for part in parts:
            self.add(part)
            yield part

    def add(self, part: SlicePart) -> None:
        """Add the errors, associations, landmarks and times of one slice of a long run to the tally."""
        scheme, truth = part.scheme, part.motion.position
        errors = position_errors(scheme.position, truth)
        self.cycles += len(errors)
        self.square += float(np.sum(errors**2))
        self.largest, self.final = max(self.largest, float(errors.max())), float(errors[-1])
        self.diverged |= has_diverged(errors, None)
        self.begin = truth[0].copy() if self.begin is None else self.begin
        relative = relative_errors(scheme, truth, self.begin)
        self.relative = _grown(self.relative, None if relative is None else relative**2)
        self.nees = _grown(self.nees, nees_per_dof(scheme, truth))
        self.start = self.start if self.outcomes else float(scheme.time[0])
        self.outcomes.update(scheme.outcome)
        self.lost.add(scheme.time, scheme.outcome, scheme.info.get("cause"))
        self.seconds += scheme.seconds.sum(axis=0)
        self.map, self.panel = scheme.map, bool(scheme.levels)
        self.overlap.add(scheme.position, truth)
        self._count_landmarks(part)
        self._count_components(part)

    def scores(self) -> dict[str, Any]:
        """Scores of one scheme of a long run, by name as `summarise_scheme` gives them."""
        walls = wall_scores(self.scene, self.map)
        seconds = dict(zip(STEPS, (self.seconds / self.cycles).tolist(), strict=True))
        nees = None if self.nees is None else self.nees / self.cycles
        return {
            "rmse_m": float(np.sqrt(self.square / self.cycles)),
            "bound_m": None,
            "over_bound": None,
            "final_m": self.final,
            "largest_m": self.largest,
            "relative_rmse_m": None if self.relative is None else float(np.sqrt(self.relative / self.cycles)),
            "relative_bound_m": None,
            "rmse_aligned_m": self.overlap.rmse() if self.cycles > 1 else None,
            "nees_per_dof": nees if nees is None or np.isfinite(nees) else None,
            "diverged": self.diverged,
            "outcomes": dict(sorted(self.outcomes.items())),
            "lost": self.lost.scores(self.start),
            "true_loss": None,
            "landmarks": self._landmarks(),
            "walls": walls,
            **found_walls(walls),
            "ghost_walls": count_ghosts(self.scene, self.map),
            "map": map_score(self.scene, self.map, panel=self.panel),
            "association": self._association()._asdict(),
            "step_seconds": seconds,
            "over_budget": over_budget(seconds, self.budget),
            "seconds": float(self.seconds.sum()),
        }

    def _count_landmarks(self, part: SlicePart) -> None:
        """Tally a slice's squared errors of each landmark, and the cycles in which it is held and identified."""
        track = landmark_track(self.scene, part.scheme, self.begin)
        panels = panel_track(self.scene, part.scheme, self.begin)
        self.landmark_square += np.nansum(track.error**2, axis=0)
        self.held += (track.column >= 0).sum(axis=0)
        self.landmark_final = track.error[-1]
        first, time = len(self.scene.scatterers), part.scheme.time
        self.identified[first:] += (panels >= 0).sum(axis=0)
        self.identified_last[first:] = panels[-1] >= 0
        for number, held in enumerate((panels >= 0).T, first):
            since = first_time(held, time)
            if since is not None:
                self.identified_from.setdefault(number, time[0] + since - self.start)

    def _landmarks(self) -> dict[str, dict[str, Any]]:
        """Scores of each true landmark from the tally of a long run, by name."""
        found: dict[str, dict[str, Any]] = {}
        for number, name in enumerate(self.scene.landmarks):
            held, final = int(self.held[number]), float(self.landmark_final[number])
            found[name] = {
                "rmse_m": float(np.sqrt(self.landmark_square[number] / held)) if held else None,
                "final_m": final if np.isfinite(final) else None,
                "bound_m": None,
                "cycles_held": held,
            }
            if self.scene.panel_number(number) >= 0:
                found[name]["cycles_identified"] = int(self.identified[number])
                found[name]["identified_last"] = bool(self.identified_last[number]) if self.panel else None
                found[name]["identified_from_s"], found[name]["audible_from_s"] = self.identified_from.get(number), None
        return found

    def _count_components(self, part: SlicePart) -> None:
        """Tally a slice's components by the landmark that the estimator associated and by their true source."""
        scheme = part.scheme
        shown = scheme.component_path != NOTHING
        label = np.maximum(scheme.component_landmark[shown], -1)
        sources = [*path_sources(part.paths, self.planes, use_vt=self.use_vt), CLUTTER]
        met, times = np.unique(np.stack([label, scheme.component_path[shown]]), axis=1, return_counts=True)
        for (who, path), count in zip(met.T.tolist(), times.tolist(), strict=True):
            self.pairs[who, sources[path]] += count

    def _association(self) -> AssociationScore:
        """Accuracy, precision and recall of data association from the tally of a long run."""
        labels = sorted({label for label, _ in self.pairs})
        sources = sorted({source for _, source in self.pairs}, key=lambda s: (s is not None, s))
        counts = np.array([[self.pairs[label, source] for source in sources] for label in labels], dtype=np.int64)
        identities = np.array([-1 if source is None else n for n, source in enumerate(sources)], dtype=np.int64)
        return association_fractions(
            np.array(labels, dtype=np.int64), identities, counts.reshape(len(labels), len(sources))
        )


class _Overlap:
    """Sums for the position RMSE after the best rotation about z and shift of the estimate (see `evaluate.align`)."""

    def __init__(self) -> None:
        self.count, self.cross = 0, 0j
        self.sums, self.squares = np.zeros((2, 3)), np.zeros((3, 3))
        self.origin: Floats | None = None

    def add(self, estimate: Floats, truth: Floats) -> None:
        """Tally estimated and true positions (K, 3) [m] of a slice, relative to the first, against cancellation."""
        self.origin = truth[0].copy() if self.origin is None else self.origin
        estimate, truth = estimate - self.origin, truth - self.origin
        self.count += len(truth)
        self.sums += np.stack([estimate.sum(axis=0), truth.sum(axis=0)])
        self.squares += np.stack([(estimate**2).sum(axis=0), (truth**2).sum(axis=0), (estimate * truth).sum(axis=0)])
        self.cross += complex(np.sum(np.conj(_plane(estimate)) * _plane(truth)))

    def rmse(self) -> float:
        """Root mean square error [m] of a long run's tallied positions after alignment."""
        mean = self.sums / self.count
        overlap = self.cross - self.count * complex(np.conj(_plane(mean[:1])[0]) * _plane(mean[1:])[0])
        own, true, both = self.squares - self.count * np.stack([mean[0] ** 2, mean[1] ** 2, mean[0] * mean[1]])
        flat = own[:2].sum() + true[:2].sum() - 2.0 * abs(overlap)
        upright = own[2] + true[2] - 2.0 * both[2]
        return float(np.sqrt(max(flat + upright, 0.0) / self.count))


def _grown(total: float | None, values: Floats | None) -> float | None:
    """Tally of a score with its values in a further slice; None where it is not known of all slices."""
    return None if total is None or values is None else total + float(np.sum(values))


def _plane(points: Floats) -> Any:
    """Horizontal coordinates of points (K, 3) as complex numbers x + jy, to tally the alignment."""
    return points[:, 0] + 1j * points[:, 1]
