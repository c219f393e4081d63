"""A receive array that cannot tell directions is said, by a check, a run and an estimate."""

import pytest

from rislam_rt.model import RadioConfig, RxArray
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.room.array_warnings import array_warnings
from rislam_rt.pipeline.run import run_warnings
from rislam_rt.shipped import find_pipeline


def said(*array: float) -> list[str]:
    return [finding.line for finding in array_warnings(RadioConfig(array=RxArray(*array)), "a.toml")]  # type: ignore[arg-type]


def test_an_array_of_two_axes_half_a_wavelength_apart_is_not_warned_of():
    assert said(4, 4) == said(2, 8, 0.25) == said(2, 2, 0.5 + 1e-9) == []


@pytest.mark.parametrize(
    ("array", "field", "what"),
    [
        ((1, 8), "rows", "1 x 8 antennas in a line tell no cosine along the body's x: a path may come from anywhere"),
        ((8, 1), "cols", "8 x 1 antennas in a line tell no cosine along the body's y: a path may come from anywhere"),
        ((1, 1), "rows", "one antenna, which tells no direction of arrival"),
    ],
)
def test_an_axis_with_one_antenna_is_said(array, field, what):
    (line,) = said(*array)
    assert line.startswith(f"a.toml: radio.array.{field}: {what}")
    assert line.endswith(
        "give two or more rows and cols (4 x 4 without these keys); 'bp_slam' and 'channel_slam' use no directions"
    )


def test_directions_that_look_alike_are_said():
    (line,) = said(4, 4, 1.0)
    assert "radio.array.spacing_wavelengths: antennas 1 wavelengths apart: directions whose cosines along" in line
    assert "the body's x or y differ by 1 look alike (all directions)" in line
    assert "x or y differ by 1.67 look alike (those with a cosine beyond 0.67 either way)" in said(4, 4, 0.6)[0]
    assert "the body's x differ by 1 look alike" in said(4, 1, 1.0)[1]
    assert len(said(1, 1, 1.0)) == 1


def test_a_run_says_it(room):
    def lines(*settings):
        return run_warnings(room, load_spec(find_pipeline("trace_then_slam"), settings))

    assert not lines()
    assert "pipeline 'trace_then_slam': radio.array.rows: 1 x 4 antennas" in lines("radio.array.rows=1")[0]
    for alone in ("bp_slam", "channel_slam_no_ris"):
        assert not lines("radio.array.rows=1", f'schemes=["{alone}"]'), "it uses no directions"
    assert lines("radio.array.rows=1", 'schemes=["bp_slam", "bp_slam_aoa"]')
