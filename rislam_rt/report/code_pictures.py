"""Pictures of the RIS panel's phase codes: level of every element, for runs and for the designs of a position."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design import Design
from rislam_rt.model import DataSheet, PathKind, RisCode, RisSpecs, SlamResult
from rislam_rt.report.style import save_figure, styled

MAX_LABELLED = 10
"""Largest side of a panel whose elements are labelled with their phase levels."""


def draw_run_codes(result: SlamResult, number: int = 5) -> Figure | None:
    """Picture of the phase codes applied at `number` cycles of a run, a row for each scheme; None without a panel."""
    schemes = [scheme for scheme in result.schemes.values() if scheme.applied.shape[1]]
    if not schemes:
        return None
    sheet = result.scene.ris.spec if result.scene.ris is not None else None
    cycles = np.unique(((np.arange(number) + 0.5) / number * len(result.scene.agent)).astype(np.int64))
    number = len(cycles)  # fewer in a run of fewer cycles
    direct = np.flatnonzero(result.paths.kind == PathKind.RIS)
    with styled():
        figure = Figure(figsize=(2.1 * number + 0.8, 2.25 * len(schemes) + 0.6))
        axes = figure.subplots(len(schemes), number, squeeze=False)
        for row, scheme in zip(axes, schemes, strict=True):
            for axis, cycle in zip(row, cycles, strict=True):
                _draw_code(axis, scheme.applied[cycle], scheme.levels, sheet)
                gain = np.abs(scheme.gain[cycle, direct]).max(initial=0.0)
                level = f"{20.0 * np.log10(gain):.1f} dB" if gain > 0.0 else "not seen"
                axis.set_title(f"t = {result.scene.agent.elapsed[cycle]:.1f} s, {level}", fontsize=9)
            row[0].set_ylabel(scheme.scheme, weight="bold")
        _colour_bar(figure, axes, schemes[0].levels)
        figure.suptitle("What the panel was set to, and the gain of its direct path", weight="bold")
    return figure


def draw_codes(designs: Mapping[str, Design], path: Path, sheet: DataSheet | None = None) -> Path:
    """Draw a picture of the phase codes that several methods designed, with the gain of their target path; return the
    file's path.

    `sheet` is the data sheet, needed for several panels.
    """
    with styled():
        columns = (len(designs) + 1) // 2
        figure = Figure(figsize=(2.4 * columns + 0.8, 5.4))
        axes = figure.subplots(2, columns, squeeze=False)
        for axis in axes.flat[len(designs) :]:
            axis.set_visible(False)
        for axis, (name, design) in zip(axes.flat, designs.items(), strict=False):
            _draw_code(axis, design.code.index, design.code.levels, sheet)
            axis.set_title(f"{name}\n{design.gain_db:.1f} dB", fontsize=9)
        _colour_bar(figure, axes, next(iter(designs.values())).code.levels)
        return save_figure(figure, path)


def _draw_code(axis: Axes, index: Integers | Floats, levels: int, sheet: DataSheet | None = None) -> None:
    """Draw the phase levels of an (N, M) code, row 0 at the bottom as on the panel; several panels side by side."""
    if isinstance(sheet, RisSpecs):
        index = _side_by_side([part.index for part in sheet.parts(RisCode(index, levels))])
    axis.imshow(index, cmap=_colours(levels), vmin=-0.5, vmax=levels - 0.5, origin="lower", interpolation="nearest")
    axis.set(xticks=[], yticks=[])
    axis.grid(False)
    if max(index.shape) <= MAX_LABELLED and np.isfinite(index).all():
        for (row, col), level in np.ndenumerate(index):
            red, green, blue, _ = _colours(levels)(int(level))
            dark = 0.299 * red + 0.587 * green + 0.114 * blue < 0.5
            axis.text(col, row, str(level), ha="center", va="center", fontsize=7, color="white" if dark else "black")


def _colours(levels: int) -> ListedColormap:
    """Colours of a code's phase levels, from a cyclic colour map."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["twilight"](np.arange(levels) / levels))


def _colour_bar(figure: Figure, axes: "np.ndarray[tuple[int, ...], np.dtype[np.object_]]", levels: int) -> None:
    """Add a colour bar of the phase shifts to a picture of codes."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(-0.5, levels - 0.5), _colours(levels))
    ticks = np.arange(levels) if levels <= 16 else np.linspace(0, levels - 1, 5).astype(int)
    bar = figure.colorbar(scale, ax=axes, ticks=ticks, fraction=0.02, pad=0.02, aspect=30)
    bar.ax.set_yticklabels([f"{360.0 * level / levels:.0f}°" for level in ticks])
    bar.set_label("phase shift ξ")


def _side_by_side(parts: Sequence[Integers]) -> Floats:
    """Join the phase codes of several panels in one array for a picture, NaN between and below them."""
    rows, cols = max(len(part) for part in parts), sum(part.shape[1] for part in parts) + len(parts) - 1
    whole, first = np.full((rows, cols), np.nan), 0
    for part in parts:
        whole[: len(part), first : first + part.shape[1]] = part
        first += part.shape[1] + 1
    return whole
