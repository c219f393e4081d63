"""Warnings of a receive array that cannot tell directions: one antenna along an axis, or antennas far apart."""

from collections.abc import Iterator

from rislam_rt.model import RadioConfig, RxArray
from rislam_rt.scene.findings import Finding, warning_at

AXES = {"x": "rows", "y": "cols"}
"""Settings of a receive array along the two axes of the body."""
WIDEST = 0.5 * (1.0 + 1e-6)
"""Spacing in wavelengths, but for rounding, up to which only the two ends of an axis look alike to a receive array."""


def untold_axes(array: RxArray) -> list[str]:
    """Axes of the body, `x` and `y`, along which a receive array has one antenna, and of which it tells no cosine."""
    return [axis for axis, count in AXES.items() if getattr(array, count) == 1]


def array_warnings(radio: RadioConfig, file: str) -> Iterator[Finding]:
    """Warnings of a receive array that tells no direction, or one cosine of it alone, or takes directions for others;
    `file` is what they name as their place."""
    array, untold = radio.array, untold_axes(radio.array)
    shape = f"{array.rows} x {array.cols} antennas"
    if len(untold) == 2:
        message = "one antenna, which tells no direction of arrival: a path's length alone is measured"
    elif untold:
        message = (
            f"{shape} in a line tell no cosine along the body's {untold[0]}: a path may come from anywhere on a cone "
            f"about the line"
        )
    if untold:
        yield warning_at(
            file, f"radio.array.{AXES[untold[0]]}",
            f"{message}, and the filter finds few walls, points and panels, or none",
            "give two or more rows and cols (4 x 4 without these keys); 'bp_slam' and 'channel_slam' use no directions",
        )  # fmt: skip
    if len(untold) < 2 and array.spacing > WIDEST:
        turn = 1.0 / array.spacing
        which = "all directions" if turn <= 1.0 else f"those with a cosine beyond {turn - 1.0:.2g} either way"
        told = " or ".join(axis for axis in AXES if axis not in untold)
        yield warning_at(
            file, "radio.array.spacing_wavelengths",
            f"antennas {array.spacing:g} wavelengths apart: directions whose cosines along the body's {told} differ by "
            f"{turn:.3g} look alike ({which}), and the filter may take one for the other",
            "take half a wavelength or less",
        )  # fmt: skip
