"""Checks of a user's table of measurements: its columns' names, and each number's range, by column and row."""

from collections.abc import Mapping

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import did_you_mean, nearest
from rislam_rt.model import RadioConfig

COLUMNS: dict[str, tuple[str, str]] = {
    "time_s": (
        "s",
        "of the cycle; rows of one time are one cycle, a row without a delay is a cycle in which nothing was heard",
    ),
    "heading_rad": ("rad", 'compass; may be left out with slam.heading = "estimated"'),
    "delay_s": ("s", "of the component, Tx to Rx"),
    "cos_x": ("1", "direction cosine of the arriving ray along the body's x (forward)"),
    "cos_y": ("1", "along the body's y (left); the ray arrives from above"),
    "theta_r_rad": ("rad", "instead of cosines: zenith angle of arrival, body frame"),
    "phi_r_rad": ("rad", "and azimuth, body frame"),
    "amplitude": ("1", "modulus of the path's gain"),
    "snr_db": ("dB", "instead: SNR after integration over the signal and all antennas"),
    "delay_std_s": ("s", "standard deviation; that of a lone path at its SNR if left out"),
    "cos_x_std": ("1", "likewise"),
    "cos_y_std": ("1", "likewise"),
    "amplitude_std": ("1", "likewise"),
    "panel_probability": ("1", "that it ran over the panel, where the receiver can tell"),
}
"""Columns of a user's table of measurements, by name: unit and meaning."""
LONGEST_DELAY = 1e-5
"""[s] Largest delay accepted, 3 km: a larger number is in another unit."""
ROUNDING = 1e-6
"""[rad] By how much the headings of one cycle may differ: the rounding of tables with six digits."""
BEYOND_HORIZON = 1.5e-3
"""By how much the sum of two squared direction cosines may exceed 1: the rounding of tables with three digits, in which
level paths, that lie on the horizon, come out beyond it."""
LARGEST_SNR_DB = 200.0
"""[dB] Largest SNR accepted, of either sign: a larger number is no decibel."""
FINEST_STD = 1e-15
"""[s] Least standard deviation of a delay accepted, 0.3 um: a smaller number is in another unit."""
ABOVE_ZERO = float(np.nextafter(0.0, 1.0))
"""Least positive number."""
NOISY_COSINE = 1.5
"""Modulus of a direction cosine up to which one above 1 is an estimate beyond the horizon; a larger is no cosine."""
_COSINE = (-1.0, 1.0, "direction cosines from -1 to 1, not angles")
BACK_TO_HORIZON = "bring estimates beyond the horizon back to it: divide both cosines by their norm"
_COSINE_STD = (ABOVE_ZERO, 2.0, "positive deviations of a direction cosine, not degrees")
_POSITIVE = (ABOVE_ZERO, np.inf, "positive numbers, not decibels")
_TIME = f"numbers in seconds, {{}}a room's below {LONGEST_DELAY:g} (were these nanoseconds, or metres?)"
RANGES: dict[str, tuple[float, float, str]] = {
    "heading_rad": (-2.0 * np.pi, 2.0 * np.pi, "at most a turn, in radians, not degrees"),
    "delay_s": (0.0, LONGEST_DELAY, _TIME.format("none below 0, ")),  # 0: a false component at the window's edge
    "cos_x": _COSINE,
    "cos_y": _COSINE,
    "theta_r_rad": (0.0, 0.5 * np.pi, "0 to pi/2, radians: a planar array cannot tell rays from below from ones above"),
    "phi_r_rad": (-2.0 * np.pi, 2.0 * np.pi, "at most a turn, in radians, not degrees"),
    "amplitude": _POSITIVE,
    "snr_db": (-LARGEST_SNR_DB, LARGEST_SNR_DB, f"decibels, {-LARGEST_SNR_DB:g} to {LARGEST_SNR_DB:g}"),
    "delay_std_s": (FINEST_STD, LONGEST_DELAY, _TIME.format(f"at least {FINEST_STD:g}, ")),
    "cos_x_std": _COSINE_STD,
    "cos_y_std": _COSINE_STD,
    "amplitude_std": _POSITIVE,
    "panel_probability": (0.0, 1.0, "probabilities from 0 to 1"),
}
"""Columns of a user's table that have a range: least and largest number, and what to give."""


def check_names(columns: Mapping[str, Floats], place: str) -> None:
    """Raise an error for columns of a user's measurements that are unknown, missing, redundant or of unequal length."""
    for number, name in enumerate(columns, start=1):
        if not name or name.startswith("Unnamed: "):
            what = "has no name, as the index of a data frame that was written with the rest"
            raise ConfigError(f"{place}: column {number}: {what}; leave it out (to_csv(..., index=False)), or name it")
        if name not in COLUMNS:
            hint = did_you_mean(nearest(name, COLUMNS)) or "mend its name:"
            raise ConfigError(f"{place}: {name}: unknown column; {hint} the known ones are {', '.join(COLUMNS)}")
    pairs = ("cos_x", "theta_r_rad"), ("cos_y", "phi_r_rad"), ("amplitude", "snr_db")
    for needed in (("time_s",), ("delay_s",), *pairs):
        if not any(name in columns for name in needed):
            raise ConfigError(f"{place}: {' or '.join(needed)}: column missing; add it")
        if len(needed) == 2 and all(name in columns for name in needed):
            raise ConfigError(f"{place}: {' and '.join(needed)}: columns that say the same; leave one out")
    if ("cos_x" in columns) != ("cos_y" in columns):
        raise ConfigError(f"{place}: a cosine beside an angle; give cos_x and cos_y, or theta_r_rad and phi_r_rad")
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        raise ConfigError(f"{place}: columns of different lengths ({sorted(lengths)}); give a row a component")
    if lengths == {0}:
        raise ConfigError(f"{place}: no rows; give at least one cycle")


def check_components(columns: Mapping[str, Floats], heard: Booleans, place: str) -> None:
    """Raise an error for a row of a user's measurements that has half a component, or a number out of range."""
    last = "of the data; fill it, or leave the component out"
    for name, column in columns.items():
        if name in ("time_s", "heading_rad"):
            continue
        lost = np.flatnonzero(~heard & np.isfinite(column))
        if len(lost):
            raise ConfigError(f"{place}: delay_s: empty beside {name} in row {lost[0] + 1} {last}")
        odd = np.flatnonzero(heard & ~np.isfinite(column))
        if len(odd):
            raise ConfigError(f"{place}: {name}: no finite number in row {odd[0] + 1} {last}")
        _check_range(name, column, heard, place)
    if "cos_x" in columns and "cos_y" in columns:
        squares = np.where(heard, columns["cos_x"] ** 2 + columns["cos_y"] ** 2, 0.0)
        odd = np.flatnonzero(squares > 1.0 + BEYOND_HORIZON)
        if len(odd):
            raise ConfigError(
                f"{place}: cos_x, cos_y: squares that sum to {squares[odd[0]]:.6g} in row {odd[0] + 1} of the data, "
                f"which no direction has; give at most 1 ({BACK_TO_HORIZON})"
            )


def _check_range(name: str, column: Floats, heard: Booleans, place: str) -> None:
    """Raise an error for a number out of the column's range in a row of a user's measurements that counts."""
    least, most, wanted = RANGES.get(name, (-np.inf, np.inf, ""))
    odd = np.flatnonzero(heard & ((column < least) | (column > most)))
    if len(odd):
        if name in ("cos_x", "cos_y"):
            wanted = cosine_wanted(np.abs(column[odd[0]]))
        raise ConfigError(f"{place}: {name}: {column[odd[0]]:g} in row {odd[0] + 1} of the data; give {wanted}")


def cosine_wanted(reach: float) -> str:
    """What to give in the place of a direction cosine of modulus `reach` > 1: its estimate within the horizon, or none
    of an angle."""
    return f"direction cosines from -1 to 1{f' ({BACK_TO_HORIZON})' if reach <= NOISY_COSINE else ', not angles'}"


def check_heading(columns: Mapping[str, Floats], cycle: Integers, place: str) -> None:
    """Raise an error unless every row of a user's measurements has its cycle's heading, or there is no such column."""
    if "heading_rad" not in columns:
        return
    heading = columns["heading_rad"]
    odd = np.flatnonzero(~np.isfinite(heading))
    if len(odd):
        raise ConfigError(
            f"{place}: heading_rad: no finite number in row {odd[0] + 1} of the data; give each row its cycle's "
            "heading, or leave the column out (slam.heading=estimated)"
        )
    _check_range("heading_rad", heading, np.ones(len(heading), dtype=np.bool_), place)
    turned = np.flatnonzero(np.abs(heading - heading[np.searchsorted(cycle, cycle)]) > ROUNDING)
    if len(turned):
        raise ConfigError(
            f"{place}: heading_rad: row {turned[0] + 1} of the data has another than its cycle's first row; give one "
            "heading a cycle"
        )


def check_amplitude(columns: Mapping[str, Floats], heard: Booleans, radio: RadioConfig, place: str) -> None:
    """Raise an error for an amplitude in a user's measurements whose SNR is no decibel that is accepted."""
    if "amplitude" not in columns:
        return
    with np.errstate(over="ignore", divide="ignore"):
        decibels = 10.0 * np.log10(radio.integrated_snr(np.where(heard, columns["amplitude"], 1.0)))
    odd = np.flatnonzero(heard & (np.abs(decibels) > LARGEST_SNR_DB))
    if len(odd):
        raise ConfigError(
            f"{place}: amplitude: {columns['amplitude'][odd[0]]:g} in row {odd[0] + 1} of the data is an SNR of "
            f"{decibels[odd[0]]:.3g} dB, beyond {LARGEST_SNR_DB:g}; give the modulus of the path's gain, or mend "
            "radio.noise_psd"
        )
