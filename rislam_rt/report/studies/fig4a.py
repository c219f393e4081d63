"""Figure, table and page of Fig. 4(a): panel gain against distance, and which of the paper's claims hold."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.design import GainCurves
from rislam_rt.report.markdown import between, picture, table_lines
from rislam_rt.report.style import SCHEME, TRUTH, styled, to_png
from rislam_rt.storage.files import csv_file, json_file, write_all
from rislam_rt.studies.fig4a import Fig4a
from rislam_rt.studies.spec import Fig4aSpec

CURVES, CURVES_FIGURE = "fig4a", "figures/fig4a.png"
SPHERE = "#009E73"
NUM_SHOWN = 9
"""Number of places in the page's table."""


def write_fig4a(
    found: Fig4a, spec: Fig4aSpec, scene: str, content: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path:
    """Write the files of Fig. 4(a): page, CSV, JSON and figure; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    page = fig4a_page(found, spec, scene, CURVES_FIGURE if figures else None)
    files = {f"{CURVES}.md": page.encode(), f"{CURVES}.csv": fig4a_csv(found)}
    if figures:
        files[CURVES_FIGURE] = to_png(draw_fig4a(found, spec))
    return write_all(folder, files | {f"{CURVES}.json": json_file(content)})


def draw_fig4a(found: Fig4a, spec: Fig4aSpec) -> Figure:
    """Draw Fig. 4(a): gain of the panel against distance, a part for each element pattern."""
    with styled():
        figure = Figure(figsize=(1.0 + 4.6 * len(found.curves), 4.6))
        axes = figure.subplots(1, len(found.curves), sharey=True, squeeze=False)[0]
        for axis, (element, curves) in zip(axes, found.curves.items(), strict=True):
            axis.plot(found.distance, curves.exact, color=TRUTH, ls="--", lw=1.2,
                      label=f"largest gain of any code, {found.levels} levels (certified)")  # fmt: skip
            for interval, colour, label in (
                (curves.optimized, SCHEME["optimized"], f"optimised codes, {spec.design.method}"),
                (curves.random, SCHEME["random"], "random codes, RMS"),
            ):
                axis.plot(found.distance, interval.middle, color=colour, lw=1.6, label=label)
                axis.fill_between(found.distance, interval.low, interval.high, color=colour, alpha=0.2, lw=0.0)
            axis.plot(found.distance, found.sphere, color=SPHERE, lw=1.6, ls="-.",
                      label=f"sphere of radius {found.radius:.3g} m in the panel's place")  # fmt: skip
            axis.set_title(f"element pattern '{element}'", weight="bold")
            axis.set_xlabel("distance from agent to panel [m]")
        axes[0].set_ylabel("gain of the direct path [dB]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    return figure


def fig4a_csv(found: Fig4a) -> bytes:
    """Encode the curves of Fig. 4(a) as CSV, a row for each element pattern and place."""
    head = [
        "element", "distance_m", "x_m", "y_m", "z_m", "optimized_db", "optimized_low_db", "optimized_high_db",
        "random_rms_db", "random_low_db", "random_high_db", "exact_db", "continuous_db", "sphere_db",
    ]  # fmt: skip
    rows: list[list[str]] = []
    for element, curves in found.curves.items():
        columns = (
            found.distance, *found.position.T, *curves.optimized, *curves.random, curves.exact, curves.continuous,
            found.sphere,
        )  # fmt: skip
        rows += [[element, *(f"{x:.4f}" for x in row)] for row in zip(*columns, strict=True)]
    return csv_file(head, rows)


def fig4a_table(found: Fig4a) -> dict[str, Any]:
    """Curves of Fig. 4(a) as plain data, with the number of places at which each of the paper's claims holds."""
    return {
        "distance_m": found.distance.tolist(),
        "sphere_radius_m": found.radius,
        "sphere_db": found.sphere.tolist(),
        "elements": {
            element: {
                "optimized_db": _interval(curves.optimized),
                "random_db": _interval(curves.random),
                "exact_db": curves.exact.tolist(),
                "continuous_db": curves.continuous.tolist(),
                "holds_at": {claim: int(np.sum(where)) for claim, where in claims(found, curves).items()},
                "median_gap_to_exact_db": float(np.median(curves.exact - curves.optimized.middle)),
            }
            for element, curves in found.curves.items()
        },
    }


def claims(found: Fig4a, curves: GainCurves) -> dict[str, Booleans]:
    """Places (K,) at which each claimed order of two curves of Fig. 4(a) holds, by claim.

    Optimised codes count by the low end of their interval.
    """
    return {
        "optimised above random codes, intervals apart": curves.optimized.low > curves.random.high,
        "optimised above the sphere": curves.optimized.low > found.sphere,
        "random codes (RMS) above the sphere": curves.random.middle > found.sphere,
    }


def fig4a_page(found: Fig4a, spec: Fig4aSpec, scene: str, figure: str | None) -> str:
    """Markdown page of Fig. 4(a): method, which claims hold, the picture if any, a table by element pattern."""
    lines = ["# Gain against distance: Fig. 4(a)", "", *_method(found, spec, scene), "", "## What holds", ""]
    lines += ["The paper's claim: optimised codes lie significantly above random codes and above the sphere.", ""]
    for element in found.curves:
        lines += [*findings_of(found, element), ""]
    lines += picture(figure, "Gain against distance")
    shown = np.unique(np.linspace(0, len(found.distance) - 1, NUM_SHOWN).round().astype(int))
    for element, curves in found.curves.items():
        spread = [[between(*ends, digits=2) for ends in zip(*both, strict=True)]
                  for both in (curves.optimized, curves.random)]  # fmt: skip
        rows = [[f"{found.distance[k]:.2f}", *(one[k] for one in spread), f"{curves.exact[k]:.2f}",
                 f"{found.sphere[k]:.2f}"] for k in shown]  # fmt: skip
        table = table_lines(["distance [m]", "optimised", "random", "optimum", "sphere"], rows)
        lines += [f"## Element pattern `{element}`, gains in dB", "", *table, ""]
    return "\n".join(lines[:-1]) + "\n"


def _method(found: Fig4a, spec: Fig4aSpec, scene: str) -> list[str]:
    """Lines of the page of Fig. 4(a) on how its curves were computed."""
    source = "ray tracing (Sionna RT)" if spec.channel == "traced" else "image sources"
    far, near, share = found.distance[0], found.distance[-1], f"{spec.coverage:.0%}"
    return [
        f"Room `{scene}`, paths by {source}, {spec.radio.carrier_ghz:g} GHz, seed {spec.seed}. Written by "
        "`rislam-rt run` from one",
        f"pipeline, do not edit. The agent walks at one height from {far:.2f} m to {near:.2f} m off the panel, "
        f"{len(found.distance)} places.",
        "",
        "Gains are those of the direct path over the panel:",
        "",
        f"- optimised: `{spec.design.method}`, median and {share} interval over {spec.seeds} seeds at each place,",
        f"- random: root mean square over all codes, and {share} interval of {spec.draws} draws,",
        f"- optimum: the largest gain of all codes with {found.levels} levels, found exactly,",
        f"- sphere: radius {found.radius:.3g} m, cross-section pi r^2, in the panel's place and touching its plane.",
    ]


def findings_of(found: Fig4a, element: str) -> list[str]:
    """Lines on which claims of Fig. 4(a) hold with one element pattern, and at which distances they fail."""
    curves = found.curves[element]
    gap = curves.exact - curves.optimized.middle
    return [
        f"With `{element}`:",
        "",
        *(f"- {claim}: {_extent(found.distance, where)}" for claim, where in claims(found, curves).items()),
        f"- optimised below the optimum: {np.median(gap):.2f} dB in the median, {gap.max():.2f} dB at most",
    ]


def _extent(distance: Floats, where: Booleans) -> str:
    """Number of places at which a claim of Fig. 4(a) holds, and the distances between which it fails, in words."""
    if where.all():
        return f"at all {len(where)} places"
    near, far = distance[~where].min(), distance[~where].max()
    if not where.any():
        return f"at none of {len(where)} places"
    return f"at {int(where.sum())} of {len(where)} places; it fails from {near:.2f} m to {far:.2f} m"


def _interval(curve: Any) -> dict[str, list[float]]:
    """Middle and ends of a gain curve of Fig. 4(a) as lists, by name."""
    return {name: values.tolist() for name, values in curve._asdict().items()}
