"""Style of all figures: colours that colour-blind readers can tell apart (Okabe and Ito), markers, file writing."""

import io
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind
from rislam_rt.storage.files import MARK, write_atomic

DPI = 120
MOST_PASSES = 6
"""Most passes of a figure's layout."""
TRUTH = "black"
WALL = "#8c8c8c"
SCHEME = {
    "optimized": "#0072B2", "random": "#D55E00", "exact": "#009E73", "genie": "#CC79A7", "no_ris": "#7a5c00",
    "bp_slam": "#56B4E9", "bp_slam_aoa": "#004B6E", "channel_slam": "#E69F00", "bp_slam_no_ris": "#30C8DC",
    "bp_slam_aoa_no_ris": "#4F7FE8", "channel_slam_no_ris": "#E8B4B8",
}  # fmt: skip
"""Colour of each built-in scheme, the same in every figure."""
MARKER = {
    "optimized": "o", "random": "s", "exact": "^", "genie": "*", "no_ris": "D", "bp_slam": "v", "bp_slam_aoa": "^",
    "channel_slam": "P", "bp_slam_no_ris": "<", "bp_slam_aoa_no_ris": ">", "channel_slam_no_ris": "p",
}  # fmt: skip
"""Marker of each built-in scheme in every figure, so that schemes differ not in colour alone."""
OWN = ("#6A3DE8", "#45330A", "#B9B95C", "#10189A", "#2FBF71", "#006050")
"""Colours of schemes that are not built in, one after another; none is a built-in scheme's."""
OWN_MARKER = ("X", "h", "8", "d", "H")
"""Their markers: with the colours, 30 schemes before one comes twice."""
KIND = {
    PathKind.LOS: "black", PathKind.VT: "#999999", PathKind.PS: "#009E73", PathKind.VS: "#7CCBB2",
    PathKind.RIS: "#D55E00", PathKind.VRIS: "#F3B583",
}  # fmt: skip
"""Colour of each path class."""
MARKED_BY = {"png": "Comment", "svg": "Description", "pdf": "Subject"}
"""Picture formats, and the metadata field of each that holds the program's mark (`storage.files.MARK`)."""
SETTINGS: dict[Any, Any] = {
    "font.size": 10, "axes.titlesize": 11, "axes.titlelocation": "left", "axes.grid": True, "grid.color": "#e3e3e3",
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "figure.constrained_layout.use": True,
}  # fmt: skip


@contextmanager
def styled() -> Iterator[None]:
    """Set the common style of all figures within this context."""
    with mpl.rc_context(SETTINGS):
        yield


def close_up(axis: Any, middle: Floats, half: float) -> None:
    """Style of a map's close-up: a framed square about a point (2,), `half` [m] to each side, without ticks."""
    axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
    axis.set(xticks=[], yticks=[])
    for spine in axis.spines.values():
        spine.set_visible(True)


class SchemeStyle(NamedTuple):
    """Style of one scheme in a figure: its colour, and its marker."""

    colour: str
    marker: str


def scheme_styles(names: Iterable[str]) -> dict[str, SchemeStyle]:
    """Style of each scheme of a figure, by name; give all of the run or study, so that all its figures agree.

    Built-in schemes have theirs for good. Others get those of `OWN` and `OWN_MARKER` in the order of `names`.
    """
    styles = {name: SchemeStyle(colour, MARKER[name]) for name, colour in SCHEME.items()}
    own = dict.fromkeys(name for name in names if name not in styles)
    return styles | dict(zip(own, map(SchemeStyle, cycle(OWN), cycle(OWN_MARKER)), strict=False))


def fix_layout(figure: Figure) -> None:
    """Give a figure in our style its final layout: maps and views in three dimensions, whose scale is fixed, need more
    passes than the one that drawing it does."""
    places: list[Any] = []
    for _ in range(MOST_PASSES):
        figure.draw_without_rendering()
        before, places = places, [axis.get_position(original=True).bounds for axis in figure.axes]
        if before and np.allclose(before, places, atol=1e-3):
            break
    figure.set_layout_engine("none")


def legend_below(figure: Figure, handles: Sequence[Any], columns: int) -> None:
    """Add a legend below a figure in our style, in as many of `columns` as its width has room for; rows that this adds
    make the figure higher."""
    for count in range(columns, 0, -1):
        legend = figure.legend(handles=handles, loc="outside lower center", ncols=count, fontsize=9)
        if count == 1 or legend.get_window_extent().width <= figure.bbox.width:
            break
        legend.remove()
    more = -(-len(handles) // count) + len(handles) // -columns
    figure.set_figheight(figure.get_figheight() + 0.2 * more)


def _save(figure: Figure, target: Any, kind: str, metadata: dict[str, str]) -> None:
    """Save a figure in our style without warnings about characters that the fonts lack, which are drawn as boxes.

    `savefig` draws twice, first only to place the axes; for PNG, whose renderer it places them with, once does.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"Glyph \d+")
        if kind == "png":
            figure.set_dpi(DPI)
            canvas: Any = FigureCanvasAgg(figure)
            canvas.print_png(target, metadata=metadata)
        else:
            figure.savefig(target, format=kind, dpi=DPI, metadata=metadata)


def to_png(figure: Figure) -> bytes:
    """Encode a figure in our style as PNG."""
    buffer = io.BytesIO()
    _save(figure, buffer, "png", {"Software": ""})
    return buffer.getvalue()


def picture_kind(path: Path) -> str:
    """Format of a figure's file by its suffix: `png`, `svg` or `pdf`.

    Raises
    ------
    ConfigError
        It is another.
    """
    kind = path.suffix.lstrip(".").lower()
    if kind not in MARKED_BY:
        raise ConfigError(f"{path}: no picture of that ending; give a name that ends in .png, .svg or .pdf")
    return kind


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure in our style to a PNG, SVG or PDF file by the file's suffix, whole or not at all.

    Raises
    ------
    ConfigError
        The suffix is another.
    StoreError
        The disk refused.
    """
    kind = picture_kind(path)
    buffer = io.BytesIO()
    _save(figure, buffer, kind, {MARKED_BY[kind]: MARK})
    write_atomic(path, buffer.getvalue())
    return path
