"""The figure of the agent's error: centimetres and metres on one axis, and where the filter held itself for lost."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.report.time_curves import draw_agent_error


def _astray(result, scale, outcome):
    """A run off by up to `scale` [m] along x, whose filter says `outcome` in its last cycle."""
    scheme = next(iter(result.schemes.values()))
    cycles = len(scheme.position)
    truth = result.scene.agent.position
    off = np.geomspace(0.01, scale, cycles)[:, None] * [1.0, 0.0, 0.0]
    told = (*scheme.outcome[:-1], outcome)
    return replace(result, schemes={"random": replace(scheme, position=truth + off, outcome=told)})


@pytest.mark.parametrize(("scale", "outcome"), [(0.02, "ok"), (3.0, "diverged")])
def test_ticks_are_plain_numbers_and_crosses_are_where_it_held_itself_for_lost(run_short, scale, outcome):
    result = _astray(run_short("cycles=6", 'schemes=["random"]'), scale, outcome)
    figure = draw_agent_error(result)
    figure.canvas.draw()
    (axis,) = figure.axes
    labels = [text.get_text() for text in [*axis.get_yticklabels(), *axis.get_yticklabels(minor=True)]]
    assert any(labels)
    assert not any("times" in label or "10^" in label for label in labels)
    crosses = [line for line in axis.lines if line.get_marker() == "x"]
    assert [len(line.get_xdata()) for line in crosses] == [int(outcome == "diverged")]
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert ("held itself for lost" in legend) == (outcome == "diverged")
    error = next(line for line in axis.lines if line.get_linestyle() == "-")
    np.testing.assert_allclose(error.get_ydata(), 100.0 * np.geomspace(0.01, scale, 6))


def test_who_knows_all_is_not_shown_to_believe_a_millimetre(run_short):
    result = _astray(run_short("cycles=6", 'schemes=["random"]'), 0.02, "ok")
    known = {name: replace(s, covariance=0.0 * s.covariance) for name, s in result.schemes.items()}
    (axis,) = draw_agent_error(replace(result, schemes=known)).axes
    dashed = next(line for line in axis.lines if line.get_linestyle() == "--")
    assert np.isnan(dashed.get_ydata()).all()


def test_markers_of_a_short_run_do_not_lie_on_each_other(run_short):
    """Of fewer than 16 cycles all schemes once had theirs at the same cycles."""
    result = run_short("cycles=6", 'schemes=["random"]')
    scheme = next(iter(result.schemes.values()))
    (axis,) = draw_agent_error(replace(result, schemes=dict.fromkeys(("random", "optimized", "no_ris"), scheme))).axes
    marked = [
        set(range(6)[line.get_markevery()[0] :: line.get_markevery()[1]])
        for line in axis.lines
        if line.get_linestyle() == "-"
    ]
    assert [len(cycles) for cycles in marked] == [2, 2, 2]
    assert set.union(*marked) == set(range(6))
