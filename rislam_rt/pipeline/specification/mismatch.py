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
    """Compass reading less true heading."""
    compass_noise_deg: NotNegative = 0.0
    """Standard deviation of the compass, white from cycle to cycle."""
    start_scale: NotNegative = 1.0
    """True errors of the start over the standard deviations that are told of it."""
    start_heading_deg: Degrees = 0.0
    """Start heading as told less the true one, where the heading is estimated."""
    height_m: Real = 0.0
    """Height at the start as told less the true one."""
    process_noise_scale: Positive = 1.0
    """Acceleration that every estimator reckons with over the one that it would be told."""
    time_scale: Annotated[float, Field(ge=0.01, le=100.0)] = 1.0
    """Time between cycles as told over the true one."""
    tilt_deg: Degrees = 0.0
    """By how much the body's front truly lies above its back (rotation about body y); it is held to be level."""
    wobble_deg: NotNegative = 0.0
    """Standard deviation of the body's true pitch and roll each, white from cycle to cycle. It turns the array; the
    ends, some centimetres from the middle, are held to stay where they are."""
    baseline_m: Real = 0.0
    """By how much the Tx is held to be farther from the agent's middle than it is."""
    clock_offset_ns: Real = 0.0
    """Delays as measured less the true ones: Tx and Rx clock apart."""
    clock_drift_ns_s: Real = 0.0
    """Growth of that offset [ns/s] from the first cycle on."""
    noise_db: Decibel = 0.0
    """N0 as told less the true one."""
    gain_db: Decibel = 0.0
    """Transmit power and antenna gains as told less the true ones."""
    antennas: Literal["", "iso"] = ""
    """Antennas as told: `iso`, isotropic and vertical, whatever they are. Must be given where they are others, as no
    estimator can be told of those."""
    std_scale: Positive = 1.0
    """Standard deviations of delays, cosines and amplitudes as reported over those that the receiver worked out."""
    threshold_db: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0
    """Detection threshold as told less the true one."""
    clutter_scale: Positive = 1.0
    """Density of false components as told over the one that the filter would reckon with."""
    array_scale: Positive = 1.0
    """True element spacing over the one that cosines are worked out with: cosines come out larger by it."""
    array_bias: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    """Added to both cosines: what the phase errors of an array that is not calibrated do, to first order."""
    bounces_less: Annotated[int, Field(ge=0, le=2)] = 0
    """By how many wall bounces the paths that the filter looks for fall short of `slam.max_bounces`."""
    panel_tilt_deg: Degrees = 0.0
    """By how much the panel's normal as told is turned away, about the panel's `right`."""
    panel_turn_deg: Degrees = 0.0
    """By how much the panel as told is turned in its own plane, about its normal."""
    panel_spacing_scale: Positive = 1.0
    """Spacing of the elements as told over the true one."""
    panel_element: Literal["", "tang", "energy"] = ""
    """Element pattern as told; the true one if not given."""
    panel_gain_db: Annotated[float, Field(ge=-60.0, le=0.0)] = 0.0
    """Gain of an element as told less the true one."""
