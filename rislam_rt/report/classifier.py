"""The classifier's page and figures: F1 room by room, what each feature is worth, and how it grows with age."""

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.pipeline.studies.classifier.gather import join
from rislam_rt.pipeline.studies.classifier.run import ALL, Training
from rislam_rt.pipeline.studies.classifier.score import Score, by_age, mistakes, rules
from rislam_rt.pipeline.studies.classifier.spec import ClassifierSpec
from rislam_rt.report.style import styled
from rislam_rt.slam.classify import network_arrays

COLOUR = {"network": "#0072B2", "geometric": "#D55E00", "amplitude": "#009E73"}
NAME = {"network": "network", "geometric": "geometric baseline", "amplitude": "amplitude rule"}
AGES = (1, 2, 3, 5, 10, 20, 40, 41)
SETS = {"plain": "Rooms as they are", "versions": "Random versions of the rooms: materials, radii, noise"}


def weights_file(found: Training) -> bytes:
    """The trained network as `.npz` without pickle."""
    buffer = io.BytesIO()
    np.savez(buffer, **network_arrays(found.network))
    return buffer.getvalue()


def draw_scores(found: Training) -> Figure:
    """F1 of every rule in every room, with intervals."""
    with styled():
        figure = Figure(figsize=(11.0, 4.6))
        for axis, (kind, title) in zip(figure.subplots(1, 2, sharey=True), SETS.items(), strict=True):
            rooms = {name: scores for name, scores in found.scores[kind].items() if _has_keep(found, kind, name)}
            place = np.arange(len(rooms))
            for shift, rule in zip((-0.22, 0.0, 0.22), NAME, strict=True):
                scores = [scores[rule] for scores in rooms.values()]
                middle = np.array([one.f1 for one in scores])
                span = [
                    middle - [min(one.low, one.f1) for one in scores],
                    [max(one.high, one.f1) for one in scores] - middle,
                ]
                axis.errorbar(middle, place + shift, xerr=span, fmt="o", ms=4, color=COLOUR[rule], label=NAME[rule])
            axis.axvline(0.98, color="black", lw=0.8, ls=":")
            axis.set(yticks=place, yticklabels=[_labelled(found, name) for name in rooms], xlabel='F1 of "keep"')
            axis.set(title=title, xlim=(0.0, 1.02))
        figure.axes[0].invert_yaxis()
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def draw_importance(found: Training) -> Figure:
    """Loss of F1 when a feature is shuffled, and F1 against the age of a track, on the test rooms as they are."""
    test = _test(found)
    with styled():
        figure = Figure(figsize=(11.0, 4.4))
        left, right = figure.subplots(1, 2)
        order = sorted(found.importance, key=lambda name: float(found.importance[name].mean()))
        mean = [float(found.importance[name].mean()) for name in order]
        left.barh(order, mean, xerr=[float(np.std(found.importance[n])) for n in order], color=COLOUR["network"])
        left.set(xlabel="loss of F1 when shuffled", title="What each feature is worth")
        for rule, judge in rules(found.network).items():
            bins = by_age(test, judge, AGES)
            right.plot(list(bins), list(bins.values()), "o-", color=COLOUR[rule], label=NAME[rule])
        right.axhline(0.98, color="black", lw=0.8, ls=":")
        right.set(xlabel="measurements of the track in the window", ylabel='F1 of "keep"', title="F1 against age")
        right.legend(loc="center", bbox_to_anchor=(0.5, 0.44))
    return figure


def classifier_table(found: Training) -> dict[str, Any]:
    """All scores as plain data."""
    return {
        "scores": {
            kind: {room: {rule: one._asdict() for rule, one in scores.items()} for room, scores in rooms.items()}
            for kind, rooms in found.scores.items()
        },
        "f1_of_restarts": found.restarts,
        "importance": {name: lost.tolist() for name, lost in found.importance.items()},
        "by_age": {rule: by_age(_test(found), judge, AGES) for rule, judge in rules(found.network).items()},
        "mistakes": {rule: mistakes(_test(found), judge) for rule, judge in rules(found.network).items()},
    }


def classifier_page(found: Training, spec: ClassifierSpec, figures: tuple[str, str] | None) -> str:
    """Markdown: what was done, scores, features."""
    trained = [room.name for room in found.rooms if room.use == "train"]
    lines = [
        "# Classifier of multipath components: scores", "",
        f"Written by `rislam-rt run` from one pipeline, do not edit. Seed {spec.seed}, paths by "
        f"{'ray tracing' if spec.channel == 'traced' else 'image sources'}; {spec.walks} random walks through each",
        f"room as it is and {spec.versions} through random versions of it, {spec.cycles} cycles each. Trained on "
        f"{', '.join(trained)}.",
        f"Intervals: {spec.coverage:.0%}, whole walks resampled. Clutter is neither kept nor removed in F1; its share",
        "that is kept stands apart.", "",
    ]  # fmt: skip
    if figures is not None:
        lines += [f"![F1 in each room]({figures[0]})", ""]
    for kind, title in SETS.items():
        lines += [f"## {title}", "", *_score_table(found, kind), ""]
    spread = f"{min(found.restarts):.4f} to {max(found.restarts):.4f}"
    lines += [f"F1 on all test rooms as they are over {len(found.restarts)} random starts of the fit: {spread}.", ""]
    lines += ["## Mistakes on the test rooms as they are", "", *_mistake_table(found), "", "## Features", ""]
    if figures is not None:
        lines += [f"![Importance of features, and F1 against age]({figures[1]})", ""]
    lines += ["| feature | loss of F1 when shuffled |", "| --- | --- |"]
    order = sorted(found.importance.items(), key=lambda item: -float(item[1].mean()))
    lines += [f"| {name} | {lost.mean():.4f} ± {lost.std():.4f} |" for name, lost in order]
    return "\n".join(lines) + "\n"


def _score_table(found: Training, kind: str) -> list[str]:
    lines = ["| room | network | precision | recall | removed rightly | clutter kept | geometric | amplitude rule |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    for name, scores in found.scores[kind].items():
        net = scores["network"]
        cells = [
            _f1(net), f"{net.precision:.3f}", f"{net.recall:.3f}", f"{net.removed:.3f}", f"{net.clutter_kept:.2f}",
            _f1(scores["geometric"]), _f1(scores["amplitude"]),
        ] if _has_keep(found, kind, name) else [
            "nothing to keep", "", "", f"{net.removed:.3f}", f"{net.clutter_kept:.2f}", "", ""
        ]  # fmt: skip
        lines.append(f"| {_labelled(found, name)} | {' | '.join(cells)} |")
    return lines


def _mistake_table(found: Training) -> list[str]:
    tables = {rule: mistakes(_test(found), judge) for rule, judge in rules(found.network).items()}
    lines = [f"| path class | examples | {' | '.join(NAME.values())} |", "| --- | --- | --- | --- | --- |"]
    for kind, (_, total) in tables["network"].items():
        wrong = " | ".join(str(tables[rule][kind][0]) for rule in NAME)
        lines.append(f"| {kind} | {total} | {wrong} |")
    return lines


def _test(found: Training) -> Any:
    return join([room.plain for room in found.rooms if room.use == "test"])


def _has_keep(found: Training, kind: str, name: str) -> bool:
    return name == ALL or any(bool(getattr(room, kind).keep.any()) for room in found.rooms if room.name == name)


def _labelled(found: Training, name: str) -> str:
    return name if name == ALL else next(f"{room.name} ({room.use})" for room in found.rooms if room.name == name)


def _f1(score: Score) -> str:
    return f"{score.f1:.3f} ({score.low:.3f} to {score.high:.3f})"
