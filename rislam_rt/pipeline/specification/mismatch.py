"""Mismatches between the truth and the model that the agent assumes: the table `[told]` of a pipeline file."""

from typing import Annotated, Literal

from pydantic import Field

from rislam_rt.pipeline.specification.section import Decibel, NotNegative, Positive, Real, Section

Degrees = Annotated[float, Field(ge=-45.0, le=45.0)]


class AssumedSection(Section):
    """Errors of the model that filter and code design assume, a setting for each quantity; by default there are none.

    `docs/told.md` lists the quantities, and what the belief makes of each.
    """

    compass_bias_deg: Degrees = 0.0
    """Bias of the compass: its reading minus the true heading."""
    compass_noise_deg: NotNegative = 0.0
    """Standard deviation of the compass's noise, white from cycle to cycle."""
    start_scale: NotNegative = 1.0
    """Ratio of the true errors of the start prior to its assumed standard deviations."""
    start_heading_deg: Degrees = 0.0
    """Assumed minus true heading at the start, where the heading is estimated."""
    height_m: Real = 0.0
    """Assumed minus true height at the start."""
    process_noise_scale: Positive = 1.0
    """Ratio of the process noise (`sigma_a`) that every estimator assumes to the one set for it."""
    time_scale: Annotated[float, Field(ge=0.01, le=100.0)] = 1.0
    """Ratio of the assumed to the true time between cycles."""
    tilt_deg: Degrees = 0.0
    """True pitch of the body, front up (rotation about body y); it is assumed to be level."""
    wobble_deg: NotNegative = 0.0
    """Standard deviation of the body's true pitch and roll each, white from cycle to cycle. It turns the array; Tx and
    Rx, some centimetres from the middle, stay where they are."""
    baseline_m: Real = 0.0
    """Error of the assumed Tx-Rx baseline: by how much the Tx is assumed farther from the Rx than it is."""
    clock_offset_ns: Real = 0.0
    """Offset between Tx and Rx clock: measured minus true delays."""
    clock_drift_ns_s: Real = 0.0
    """Drift of the clock offset [ns/s] from the first cycle on."""
    noise_db: Decibel = 0.0
    """Assumed minus true noise power density N0."""
    gain_db: Decibel = 0.0
    """Assumed minus true gain of transmit power and antennas."""
    antennas: Literal["", "iso"] = ""
    """Assumed antennas: `iso`, isotropic and vertical, whatever the true ones are. Must be given where those are
    others, which no estimator can assume."""
    std_scale: Positive = 1.0
    """Ratio of reported standard deviations of delays, cosines and amplitudes to those that the receiver computed."""
    threshold_db: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0
    """Assumed minus true detection threshold."""
    clutter_scale: Positive = 1.0
    """Ratio of the assumed density of false components to the receiver model's."""
    array_scale: Positive = 1.0
    """Ratio of the array's true to its assumed element spacing, by which direction cosines come out larger."""
    array_bias: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    """Bias of both direction cosines, the first-order effect of phase errors in an array that is not calibrated."""
    bounces_less: Annotated[int, Field(ge=0, le=2)] = 0
    """By how many wall bounces the filter's path models fall short of `slam.max_bounces`."""
    panel_tilt_deg: Degrees = 0.0
    """Error of the panel's assumed normal: its rotation about the panel's `right`."""
    panel_turn_deg: Degrees = 0.0
    """Error of the panel's assumed orientation in its plane: its rotation about the normal."""
    panel_spacing_scale: Positive = 1.0
    """Ratio of the assumed to the true spacing of the panel's elements."""
    panel_element: Literal["", "tang", "energy"] = ""
    """Assumed pattern of the panel's elements; the true one if not given."""
    panel_gain_db: Annotated[float, Field(ge=-60.0, le=0.0)] = 0.0
    """Assumed minus true gain of a panel's element."""
