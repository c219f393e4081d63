"""Floor 3: physics of the panel. Pure functions of geometry; the channel and the agent's belief both call them."""

from rislam_rt.ris.element import element_gain_area, element_pattern
from rislam_rt.ris.response import far_field_response, leg_response, panel_gain, rephase, zero_code

__all__ = [
    "element_gain_area",
    "element_pattern",
    "far_field_response",
    "leg_response",
    "panel_gain",
    "rephase",
    "zero_code",
]
