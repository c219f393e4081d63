"""The page and figures of the component classifier's scores: F1 by room, path class, track age, SNR and feature."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.report.markdown import between, paragraph, picture, table_lines
from rislam_rt.report.style import styled
from rislam_rt.slam.classify import FEATURES, network_arrays
from rislam_rt.studies.classifier.score import by_value, mistakes, panel_dropped, rules
from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.classifier.train import Training
from rislam_rt.studies.classifier.training_examples import Examples
from rislam_rt.studies.classifier.walks import POLICIES

COLOUR = {"network": "#0072B2", "single": "#56B4E9", "geometric": "#D55E00", "amplitude": "#009E73"}
MARK = {"network": "o", "single": "^", "geometric": "s", "amplitude": "D"}
NAME = {
    "network": "network, over a track's life", "single": "network, single look", "geometric": "geometric baseline",
    "amplitude": "amplitude rule",
}  # fmt: skip
AGES = (1, 2, 3, 5, 10, 20, 40, 41)
SNRS = (5, 10, 13, 16, 20, 25, 30, 40, 60)
CODES = """`random` a new one each cycle; `held` one random one; `aimed` the best for the direct path from the middle of
the walk, held; `exact` the best for the direct path in each cycle."""
FEWEST = 5
"""Least number of examples of the direct panel path in a room and policy for its share of mistakes to be shown."""


def weights_file(found: Training) -> bytes:
    """Encode the trained network of the classifier as the content of an `.npz` file without pickle."""
    buffer = io.BytesIO()
    np.savez(buffer, **network_arrays(found.network))
    return buffer.getvalue()


def draw_scores(found: Training) -> Figure:
    """Draw the classifier's scores: F1 of every classification rule in every room, with intervals."""
    rooms = {name: scores for name, scores in found.scores.items() if has_keep(found, name)}
    place = np.arange(len(rooms))
    with styled():
        figure = Figure(figsize=(11.0, 5.0))
        for axis, low in zip(figure.subplots(1, 2, sharey=True), (0.0, 0.9), strict=True):
            for shift, rule in zip((-0.27, -0.09, 0.09, 0.27), NAME, strict=True):
                scores = [scores[rule] for scores in rooms.values()]
                middle = np.array([one.f1 for one in scores])
                span = [
                    middle - [min(one.low, one.f1) for one in scores],
                    [max(one.high, one.f1) for one in scores] - middle,
                ]
                axis.errorbar(
                    middle, place + shift, xerr=span, fmt=MARK[rule], ms=4, color=COLOUR[rule], label=NAME[rule]
                )
            axis.axvline(0.98, color="black", lw=0.8, ls=":")
            axis.set(yticks=place, yticklabels=list(rooms), xlabel='F1 of "keep"', xlim=(low, 1.0 + 0.02 * (1.0 - low)))
        figure.axes[0].set_title("All scores")
        figure.axes[1].set_title("The same from 0.9; dotted: the aim, 0.98")
        figure.axes[0].invert_yaxis()
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_importance(found: Training) -> Figure:
    """Draw the importance of the classifier's features, and F1 against the track's age and SNR, on the test rooms."""
    with styled():
        figure = Figure(figsize=(12.0, 4.8))
        left, middle, right = figure.subplots(1, 3)
        order = sorted(found.importance, key=lambda name: float(found.importance[name].mean()))
        mean = [float(found.importance[name].mean()) for name in order]
        left.barh(order, mean, xerr=[float(np.std(found.importance[n])) for n in order], color=COLOUR["network"])
        left.set(xlabel="loss of F1 when shuffled", title="What each feature is worth")
        left.tick_params(axis="y", labelsize=7)
        for rule in NAME:
            for axis, bins in ((middle, _by_age(found, rule)), (right, _by_snr(found, rule))):
                height = [score for score, _ in bins.values()]
                axis.plot(list(bins), height, marker=MARK[rule], color=COLOUR[rule], label=NAME[rule])
        for axis in (middle, right):
            axis.axhline(0.98, color="black", lw=0.8, ls=":")
            axis.tick_params(axis="x", labelsize=7)
        middle.set(xlabel="measurements of the track in the window", ylabel='F1 of "keep"', title="F1 against age")
        right.set(xlabel="integrated SNR [dB]", title="F1 against SNR")
        figure.legend(*middle.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_panel(found: Training) -> Figure:
    """Draw how often the classifier wrongly removes the direct panel path, a dot a room, by code policy and rule."""
    judges = rules(found.network)
    with styled():
        figure = Figure(figsize=(9.0, 4.0))
        axis = figure.subplots()
        for shift, rule in zip((-0.27, -0.09, 0.09, 0.27), NAME, strict=True):
            for number, policy in enumerate(POLICIES):
                looks = [panel_dropped(examples, judges[rule])[policy] for examples in _rooms(found).values()]
                share = np.array(sorted(dropped / total for dropped, total in looks if total >= FEWEST))
                place = number + shift + np.linspace(-0.06, 0.06, len(share))
                label = NAME[rule] if number == 0 else None
                axis.plot(place, share, MARK[rule], ms=4, color=COLOUR[rule], alpha=0.7, label=label)
        axis.set(xticks=range(len(POLICIES)), xticklabels=POLICIES, xlabel="codes", title="A dot for each room")
        axis.set(ylim=(-0.04, 1.04), ylabel="share of looks in which\nthe direct panel path is dropped")
        figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def classifier_table(found: Training) -> dict[str, Any]:
    """All scores of the classifier as plain data, for the JSON file beside its page."""
    tested, drawn, judges = found.sets.tested, found.sets.all_drawn, rules(found.network)
    return {
        "scores": {
            room: {rule: one._asdict() for rule, one in scores.items()} for room, scores in found.scores.items()
        },
        "mean_over_rooms": {rule: mean.tolist() for rule, mean in found.mean.items()},
        "share": {name: share_of(found, name) for name in found.sets.test},
        "f1_of_restarts": found.restarts,
        "importance": {name: lost.tolist() for name, lost in found.importance.items()},
        "by_age": {rule: _by_age(found, rule) for rule in NAME},
        "by_snr": {rule: _by_snr(found, rule) for rule in NAME},
        "mistakes": {rule: mistakes(tested, judge) for rule, judge in judges.items()},
        "mistakes_in_drawn_rooms": {rule: mistakes(drawn, judge) for rule, judge in judges.items()},
        "panel_dropped": {
            name: {rule: panel_dropped(examples, judge) for rule, judge in judges.items()}
            for name, examples in _rooms(found).items()
        },
    }


def classifier_page(found: Training, spec: ClassifierSpec, figures: Sequence[str] | None) -> str:
    """Markdown page of the classifier: method, scores by room and path class, panel by code policy, features."""
    about = f"""Written by `rislam-rt run` from one pipeline, do not edit. Seed {spec.seed}, paths by
    {"ray tracing" if spec.channel == "traced" else "image sources"}, receiver `{spec.receiver.estimator}`. Trained on
    {spec.train} random rooms, one walk of {spec.cycles} cycles each, reference SNR {spec.snr_low_db:g} to
    {spec.snr_high_db:g} dB; the random start chosen on {spec.validation} further ones. Tested on {spec.walks} random
    walks through each named room, and on the drawn rooms {spec.drawn_first} to {spec.drawn_first + spec.drawn - 1}
    along their own motion; none of them was trained on, and each walk is gone under all codes: {CODES} Intervals:
    {spec.coverage:.0%}, whole walks resampled. Clutter is neither kept nor removed in F1; its share that is kept stands
    apart."""
    scores, features, panel = figures or (None, None, None)
    lines = ["# Classifier of multipath components: scores", "", *paragraph(about), ""]
    lines += [*picture(scores, "F1 in each room"), "## Scores", "", *_score_table(found), ""]
    starts = ", ".join(f"{chosen:.4f} and {tested:.4f}" for chosen, tested in found.restarts)
    told = "the mean over classes of the share told rightly in the random rooms for validation,"
    lines.append(f"Of each random start, {told}")
    lines.append(f"and F1 on all test rooms: {starts}.")
    lines += ["", "## The panel's direct path", "", *_panel_summary(found), ""]
    lines += picture(panel, "Share of looks at the panel that are dropped, room by room")
    lines += ["### Room by room", "", *_panel_rooms(found), ""]
    lines += ["## By class", "", "Share told wrongly: of LOS and VT kept, of the others removed.", ""]
    for title, examples in (("Named rooms", found.sets.tested), ("Drawn rooms", found.sets.all_drawn)):
        lines += [f"### {title}", "", *_class_table(found, examples), ""]
    lines += ["### By room, of the network", "", *_room_mistakes(found), ""]
    lines += ["### By age and by SNR", "", *_bin_table(found), "", "## Features", ""]
    lines += picture(features, "Importance of features, and F1 against age and SNR")
    order = sorted(found.importance.items(), key=lambda item: -float(item[1].mean()))
    worth = [[name, f"{lost.mean():.4f} ± {lost.std():.4f}"] for name, lost in order]
    lines += table_lines(["feature", "loss of F1 when shuffled"], worth)
    return "\n".join(lines) + "\n"


def has_keep(found: Training, name: str) -> bool:
    """Whether the classifier's page has a row for a room: whether it has any component to keep."""
    return name not in found.sets.test or bool(found.sets.test[name].keep.any())


def share_of(found: Training, name: str) -> tuple[float, float]:
    """For the classifier's page: share of all components of its test, and of those to keep, that a named room has."""
    room, tested = found.sets.test[name], found.sets.tested
    return float(room.labelled.sum() / tested.labelled.sum()), float(room.keep.sum() / max(tested.keep.sum(), 1))


def _score_table(found: Training) -> list[str]:
    """Table of the classifier's scores by room."""
    titles = ["room", "share of components", "of those to keep", *NAME.values(), "precision", "recall",
              "removed rightly", "clutter kept"]  # fmt: skip
    rows = []
    for name, scores in found.scores.items():
        net = scores["network"]
        share = [f"{part:.2f}" for part in share_of(found, name)] if name in found.sets.test else ["", ""]
        tail = [f"{net.removed:.3f}", f"{net.clutter_kept:.2f}"]
        if has_keep(found, name):
            found_f1 = [between(one.f1, one.low, one.high) for one in (scores[rule] for rule in NAME)]
            cells = [*found_f1, f"{net.precision:.3f}", f"{net.recall:.3f}"]
        else:
            cells = ["nothing to keep", "", "", "", "", ""]
        rows.append([name, *share, *cells, *tail])
    mean = [between(*found.mean[rule]) for rule in NAME]
    return table_lines(titles, [*rows, ["mean over test rooms", "", "", *mean, "", "", "", ""]])


def _rooms(found: Training) -> dict[str, Examples]:
    """All rooms of the classifier's test, named and drawn."""
    return {**found.sets.test, **found.sets.drawn}


def _panel_summary(found: Training) -> list[str]:
    """Table of the classifier's page: how often the direct panel path is removed, by code policy and rule, of all
    examples, and worst room."""
    judges = rules(found.network)
    titles = ["codes", "looks", "rooms", *(f"{name}: dropped, worst room" for name in NAME.values())]
    rows = []
    for policy in POLICIES:
        cells = []
        for rule in NAME:
            looks = [panel_dropped(examples, judges[rule])[policy] for examples in _rooms(found).values()]
            dropped, total = np.sum(looks, axis=0)
            shares = [part / whole for part, whole in looks if whole >= FEWEST]
            cells.append(f"{dropped / max(total, 1):.3f}, {max(shares, default=0.0):.2f}")
        heard = sum(whole >= FEWEST for _, whole in looks)
        rows.append([f"`{policy}`", str(total), str(heard), *cells])
    return [*table_lines(titles, rows), "", f"Rooms: those with {FEWEST} looks or more, of which the worst one is."]


def _panel_rooms(found: Training) -> list[str]:
    """Table of the classifier's page: how often the direct panel path is removed in each room, by the network, and by
    baselines."""
    judges = rules(found.network)
    titles = ["room", *(f"`{policy}`" for policy in POLICIES), "geometric, `exact`", "amplitude, `exact`"]
    rows = []
    for name, examples in _rooms(found).items():
        own = {rule: panel_dropped(examples, judges[rule]) for rule in NAME}
        if any(total for _, total in own["network"].values()):
            looks = [*own["network"].values(), own["geometric"]["exact"], own["amplitude"]["exact"]]
            rows.append([name, *("{} of {}".format(*pair) if pair[1] else "" for pair in looks)])
    return table_lines(titles, rows)


def _class_table(found: Training, examples: Examples) -> list[str]:
    """Table of the share of misclassified examples by path class and rule."""
    tables = {rule: mistakes(examples, judge) for rule, judge in rules(found.network).items()}
    rows = [[kind, str(total), *(f"{tables[rule][kind][0] / total:.3f}" for rule in NAME)]
            for kind, (_, total) in tables["network"].items()]  # fmt: skip
    return table_lines(["path class", "examples", *NAME.values()], rows)


def _room_mistakes(found: Training) -> list[str]:
    """Table of the network's misclassified examples by room and path class."""
    judge = rules(found.network)["network"]
    tables = {name: mistakes(examples, judge) for name, examples in found.sets.test.items()}
    kinds = list(mistakes(found.sets.tested, judge))
    rows = [[name, *("{} of {}".format(*table[kind]) if kind in table else "" for kind in kinds)]
            for name, table in tables.items()]  # fmt: skip
    return table_lines(["room", *kinds], rows)


def _bin_table(found: Training) -> list[str]:
    """Table of F1 by the track's age and by SNR."""
    rows = []
    for unit, maker in (("measurements", _by_age), ("dB", _by_snr)):
        bins = {rule: maker(found, rule) for rule in NAME}
        for name, (_, count) in bins["network"].items():
            rows.append([f"{name} {unit}", str(count), *(f"{bins[rule][name][0]:.3f}" for rule in NAME)])
    return table_lines(["bin", "examples", *NAME.values()], rows)


def _by_age(found: Training, rule: str) -> dict[str, tuple[float, int]]:
    """F1 and number of examples by the track's age."""
    tested = found.sets.tested
    return by_value(tested, rules(found.network)[rule], tested.age.astype(np.float64), AGES)


def _by_snr(found: Training, rule: str) -> dict[str, tuple[float, int]]:
    """F1 and number of examples by SNR [dB]."""
    tested = found.sets.tested
    level = 10.0 / np.log(10.0) * tested.features[:, FEATURES.index("snr")]
    return by_value(tested, rules(found.network)[rule], level, SNRS)
