"""The map from above of a run: nothing of it is cut off, and nothing of a lost scheme crosses the others."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rislam_rt.report.map_from_above import draw_above


def drawn(result):
    figure = draw_above(result)
    FigureCanvasAgg(figure).draw()
    return figure


def astray(result, name, metres):
    scheme = result.schemes[name]
    lost = replace(scheme, position=scheme.position + np.linspace(0.0, metres, 6)[:, None] * [0.0, 1.0, 0.0])
    return replace(result, schemes={**result.schemes, name: lost})


def captions(axis):
    return [text.get_text() for inset in axis.child_axes for text in inset.texts]


@pytest.mark.parametrize("count", [1, 2])
def test_the_legend_lies_inside_the_figure(result, count):
    figure = drawn(replace(result, schemes=dict(list(result.schemes.items())[:count])))
    box, page = figure.legends[0].get_window_extent(), figure.bbox
    assert page.x0 <= box.x0 < box.x1 <= page.x1
    assert page.y0 <= box.y0 < box.y1 <= page.y1


def test_a_lost_scheme_takes_no_close_up_from_the_others(result):
    before = [captions(axis) for axis in drawn(result).axes]
    figure = drawn(astray(result, "random", 9.0))
    assert [captions(axis) for axis in figure.axes] == [[], before[1]]
    assert figure.axes[0].get_title(loc="left").endswith(" m")
    assert before[1][0].endswith("50 cm wide") or before[1] == ["50 cm"]


def test_what_is_drawn_stays_in_its_own_map(result):
    """The frame of a close-up, once wider than the room, crossed the whole figure."""
    figure = drawn(astray(result, "random", 9.0))
    for axis in figure.axes:
        pane = axis.get_window_extent().padded(1.0)
        for inset in axis.child_axes:
            frame = inset.get_xlim(), inset.get_ylim()
            low, high = (axis.transData.transform([side[end] for side in frame]) for end in (0, 1))
            assert pane.contains(*low)
            assert pane.contains(*high)
            (words,) = (text.get_window_extent() for text in inset.texts)
            room = inset.get_window_extent()
            assert room.x0 <= words.x0 < words.x1 <= room.x1
