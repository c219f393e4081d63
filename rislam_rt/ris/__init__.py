"""Floor 3: physics of the RIS panel, and predicted amplitudes of paths over landmarks: pure functions."""

from rislam_rt.ris.impairments import PanelErrors, PanelTolerance, draw_panel, flip_bits
from rislam_rt.ris.rephase import panel_gain, rephase
from rislam_rt.ris.response import (
    delay_spread,
    delay_spread_warnings,
    element_gain_area,
    element_pattern,
    far_field_response,
    leg_response,
    zero_code,
)

__all__ = [
    "PanelErrors", "PanelTolerance", "delay_spread", "delay_spread_warnings", "draw_panel", "element_gain_area",
    "element_pattern", "far_field_response", "flip_bits", "leg_response", "panel_gain", "rephase", "zero_code",
]  # fmt: skip
