"""The waveform-driven receiver: simulates the received signal of a cycle and estimates multipath components from it.

Which path each component most likely is, its true identity, is for scoring only, never shown to the agent.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, join_rows, take_rows
from rislam_rt.information import measurement_std
from rislam_rt.measurement.components import ReportedComponents, capped_cosine_std, clip_to_unit_disc
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.detection_threshold import detection_threshold
from rislam_rt.measurement.estimation.detect import MatchedFilterGrid, build_grid
from rislam_rt.measurement.estimation.estimate import NOTHING, estimate_paths
from rislam_rt.measurement.estimation.path_signals import Sounding, build_sounding
from rislam_rt.measurement.estimation.refine import LeastSquaresFit, accuracy
from rislam_rt.measurement.hardware import FrontEnd, SentSignal, digitise, draw_gain_variation, scaled_to_fit
from rislam_rt.measurement.joint_bound import LEAST_CERTAINTY
from rislam_rt.measurement.panel_probability import panel_probability
from rislam_rt.measurement.received_paths import Received
from rislam_rt.measurement.received_signal import num_tones, tones
from rislam_rt.measurement.slot_motion import codes_in_turn, split_by_code
from rislam_rt.measurement.variance_inflation import crowding, mirror_variance, peak_bias, unmirrored
from rislam_rt.model import Measurement, PathTruth, RadioConfig


class Capture(NamedTuple):
    """Received samples of one cycle: of all paths, or the sum or one panel's difference of alternated codes."""

    samples: Complexes
    """(L, M) tones [sqrt(J)] at full energy E."""
    noise_psd: float
    """Variance per tone, converters included [J]."""
    number: int
    """0 for the sum; under alternation 1 + q for the difference of panel q, which that panel's paths enter, and what
    turns within the slot."""


class DetectedComponents(NamedTuple):
    """N multipath components estimated from samples, in the order of their delays."""

    tau: Floats
    """(N,) [s] delay."""
    cosines: Floats
    """(N, 2) direction cosines in the body frame."""
    gain: Complexes
    """(N,) complex gain."""
    tau_std: Floats
    """(N,) [s] standard deviation of the delay."""
    cosines_std: Floats
    """(N, 2) standard deviations of the cosines."""
    amplitude_std: Floats
    """(N,) standard deviation of the gain's magnitude."""
    capture: Integers
    """(N,) number of the capture that it was found in."""


def capture(
    received: Received, radio: RadioConfig, config: ReceiverConfig, front_end: FrontEnd | None = None,
    leakage: complex = 0.0, *, rng: np.random.Generator,
) -> list[Capture]:  # fmt: skip
    """Simulate the waveform receiver's samples of a cycle: one capture, or with alternation the sum and differences of
    codes.

    Sum and difference of the two halves, over sqrt 2, hold the walls' and the panel's paths at the full energy and the
    noise of one sounding: splitting the slot costs nothing but a second code. What turns within the slot is in both.
    Several panels take as many codes as a Hadamard matrix that has a row for each (`slot_motion.codes_in_turn`).

    Parameters
    ----------
    front_end
        A real receiver; None for an ideal one.
    leakage
        Gain of the direct path before its cancellation: a real receiver's cancellation leaves something of it.
    """
    heard = split_by_code(received, config)
    elements = None if front_end is None else radio.array.positions(1.0) + front_end.offset
    swing = 1.0 if front_end is None else draw_gain_variation(front_end.config, rng=rng)
    clean = [tones(one, radio, config, elements) for one in heard]
    direct = leakage * np.sqrt(radio.energy / num_tones(radio, config))
    if not config.alternation:
        return [Capture(*digitise(clean[0], SentSignal(1.0, direct, swing), radio, config, front_end, rng=rng), 0)]
    signs = codes_in_turn(config.panels)
    share = np.sqrt(1.0 / len(signs))
    sent = SentSignal(share, share * direct, swing)
    heard_under = [
        digitise(share * _signed_sum(clean, code), sent, radio, config, front_end, rng=rng) for code in signs.T
    ]
    under = [samples for samples, _ in heard_under]
    if front_end is not None and front_end.correction is not None:
        under[1:] = [scaled_to_fit(other, under[0]) for other in under[1:]]
    level = sum(noise for _, noise in heard_under) / len(signs)
    return [Capture(share * _signed_sum(under, signs[number]), level, number) for number in range(config.num_captures)]


def _signed_sum(parts: list[Complexes], signs: Floats) -> Complexes:
    """Sum of the received samples (L, M) of several codes, each multiplied by its sign."""
    total = signs[0] * parts[0]
    for part, sign in zip(parts[1:], signs[1:], strict=False):
        total = total + sign * part
    return np.asarray(total)


def find_components(
    captures: list[Capture], radio: RadioConfig, config: ReceiverConfig, previous: Measurement | None = None
) -> DetectedComponents:
    """Estimate the multipath components in a cycle's captures, starting from those of the previous cycle, if given."""
    parts = [_find(one, radio, config, _known(one, radio, previous)) for one in captures]
    joined = join_rows(parts)
    return take_rows(joined, np.argsort(joined[0]))


def measure_waveform(
    received: Received, radio: RadioConfig, config: ReceiverConfig, previous: Measurement | None = None,
    front_end: FrontEnd | None = None, leakage: complex = 0.0, *, rng: np.random.Generator,
) -> tuple[Measurement, PathTruth]:  # fmt: skip
    """Simulate a cycle's received signal and estimate its multipath components, and the paths they likeliest are."""
    captures = capture(received, radio, config, front_end, leakage, rng=rng)
    found = find_components(captures, radio, config, previous)
    return to_measurement(found, radio, config), PathTruth(true_paths(found, received, radio, config))


def true_paths(found: DetectedComponents, received: Received, radio: RadioConfig, config: ReceiverConfig) -> Integers:
    """Column (N,) of the true path of its capture that each component of the waveform receiver likely is; -1 for
    none."""
    path = np.full(len(found.tau), -1)
    for number, heard in enumerate(split_by_code(received, config)):
        mine = found.capture == number
        path[mine] = identify(found.tau[mine], found.cosines[mine], found.gain[mine], heard, radio)
    return path


def to_measurement(found: DetectedComponents, radio: RadioConfig, config: ReceiverConfig) -> Measurement:
    """Measurement that the waveform receiver reports of estimated components, with the probability that each came over
    the panel."""
    told: tuple[Any, ...] = ()
    if config.alternation:
        points, deviation = (
            np.column_stack(pair) for pair in ((found.tau, found.cosines), (found.tau_std, found.cosines_std))
        )
        nobody, spread = np.full(len(found.tau), -1), np.sqrt(2.0) * found.amplitude_std
        seen = ReportedComponents(nobody, points, deviation, found.gain, spread, found.capture)
        told = panel_probability(seen, radio, config)
    return Measurement(
        found.tau, found.cosines, np.abs(found.gain), found.tau_std, found.cosines_std, found.amplitude_std, *told
    )


def _known(one: Capture, radio: RadioConfig, previous: Measurement | None) -> Floats:
    """Parameters (Q, 3) of the last cycle's components, of one capture, where the waveform receiver's search begins."""
    if previous is None:
        return NOTHING
    mine = np.ones(len(previous), dtype=bool)
    if previous.from_panel is not None:
        number = 0 if previous.panel is None else previous.panel
        mine = np.where(previous.from_panel > 0.5, 1 + number, 0) == one.number
    return np.column_stack([previous.tau * radio.bandwidth, previous.cosines])[mine]


def _find(one: Capture, radio: RadioConfig, config: ReceiverConfig, known: Floats) -> DetectedComponents:
    """Components that the waveform receiver estimates in one capture, with what the bound leaves out in their stds."""
    window = (config.min_delay * radio.bandwidth, config.max_delay * radio.bandwidth)
    sounding, grid = _searched(one.samples.shape[1], window, radio, config)
    threshold = detection_threshold(radio, config)
    samples = one.samples / np.sqrt(one.noise_psd)
    fit = estimate_paths(sounding, grid, samples, threshold, window, config.max_components, known)
    parameters, gain, deviation, amplitude_std = _resolved(fit, one.samples.size, radio)
    inside, gain = unmirrored(parameters[:, 1:], gain, radio)
    cosines = clip_to_unit_disc(inside)
    variance = deviation**2 * peak_bias(np.abs(gain) ** 2 * one.samples.size)[:, None]
    variance *= crowding(parameters, threshold, radio)
    mirrored = mirror_variance(inside, np.sqrt(variance[:, 1:]), radio)
    scale = np.sqrt(one.noise_psd * one.samples.shape[1] / radio.energy)
    return DetectedComponents(
        np.clip(parameters[:, 0], *window) / radio.bandwidth,
        cosines,
        scale * gain,
        np.sqrt(variance[:, 0]) / radio.bandwidth,
        np.hypot(capped_cosine_std(np.sqrt(variance[:, 1:]), radio), np.sqrt(mirrored)),
        scale * amplitude_std,
        np.full(len(gain), one.number),
    )


@lru_cache(maxsize=16)
def _searched(
    count: int, window: tuple[float, float], radio: RadioConfig, config: ReceiverConfig
) -> tuple[Sounding, MatchedFilterGrid]:
    """Sounding of `count` tones for the waveform receiver, and its grid over a window of delays in resolution cells."""
    sounding = build_sounding(count, radio, element_exact=config.element_exact)
    return sounding, build_grid(sounding, window)


def _resolved(fit: LeastSquaresFit, samples: int, radio: RadioConfig) -> tuple[Floats, Complexes, Floats, Floats]:
    """Components of the waveform receiver after merging estimated paths that cannot be resolved: parameters (N, 3),
    gains (N,), their standard deviations (N, 3), (N,)."""
    # Paths between which the data cannot share the amplitude out are reported as one, as wide as they lie apart.
    parameters, amplitude, bound = fit.parameters, fit.amplitude, accuracy(fit)
    label = _groups(parameters, np.abs(amplitude) < LEAST_CERTAINTY * bound.amplitude, radio)
    member = (label == np.unique(label)[:, None]).astype(np.float64)
    gain = member @ amplitude
    spread = np.real(np.sum((member @ fit.covariance) * member, axis=1))
    single = member.sum(axis=1) == 1
    share = member * np.abs(amplitude)
    share /= share.sum(axis=1, keepdims=True)
    centre = share @ parameters
    lone = measurement_std(np.abs(gain) ** 2 * samples, radio)
    lone_std = np.column_stack([lone.tau * radio.bandwidth, lone.cosines])
    offset = np.where(member[..., None] > 0.0, np.abs(parameters - centre[:, None]), 0.0).max(axis=1, initial=0.0)
    deviation = np.where(single[:, None], member @ bound.parameters, np.hypot(lone_std, offset))
    variance = np.where(single, member @ bound.amplitude**2, spread)
    sure = np.abs(gain) ** 2 > LEAST_CERTAINTY**2 * variance
    return centre[sure], gain[sure], deviation[sure], np.sqrt(variance[sure] / 2.0)


def _groups(parameters: Floats, doubtful: Booleans, radio: RadioConfig) -> Integers:
    """Component (P,) that each path of the waveform receiver joins: unresolved ones their nearest neighbour's."""
    count = len(parameters)
    label = np.arange(count)
    if count < 2:
        return label
    beams = [1.0 / (n * radio.array.spacing) if n > 1 else np.inf for n in (radio.array.rows, radio.array.cols)]
    cell = np.array([1.0, *beams])
    distance = np.linalg.norm((parameters[:, None] - parameters) / cell, axis=-1) + np.diag(np.full(count, np.inf))
    for row in np.flatnonzero(doubtful):
        nearest = int(np.argmin(distance[row]))
        if distance[row, nearest] < 1.0:
            label[label == label[row]] = label[nearest]
    return label


TOLERANCE = 0.3
"""Misfit of a delay or cosine [resolution cells] that counts as one unit."""
LOUDNESS = 6.0
"""Misfit of the amplitude [dB] that counts as one unit."""
GATE = 9.0
"""Largest sum of squared misfits at which a component is taken for a path."""
FAINTEST = 1.0
"""SNR over all antennas (linear) below which no path is taken for the cause of a component."""


def identify(tau: Floats, cosines: Floats, gain: Complexes, received: Received, radio: RadioConfig) -> Integers:
    """Column (N,) of the true path that each component of the receiver most likely is, -1 for none.

    The assignment with the least sum of squared misfits in delay, cosines and amplitude. The scale is the resolution
    cell, not the bound: next to a stronger path a component errs by more than its bound, and is still that path. So it
    is if it came out on the wrong side of the sky, where the array cannot tell (`u` from `u - 1 / spacing`).
    """
    heard = np.flatnonzero(radio.integrated_snr(received.gain) > FAINTEST)
    beams = [1.0 / (n * radio.array.spacing) if n > 1 else np.inf for n in (radio.array.rows, radio.array.cols)]
    delay = (tau[:, None] - received.tau[heard]) * radio.bandwidth / TOLERANCE
    period = 1.0 / radio.array.spacing
    offset = cosines[:, None] - received.direction[heard, :2]
    angle = (offset - period * np.round(offset / period)) / np.array(beams) / TOLERANCE
    ratio = np.abs(gain)[:, None] / np.abs(received.gain[heard])
    loudness = 20.0 * np.log10(np.maximum(ratio, 1e-300)) / LOUDNESS
    misfit = delay**2 + np.sum(angle**2, axis=-1) + loudness**2
    # A stand-in column for each component, at the gate, makes "none of them" the answer where nothing fits.
    cost = np.concatenate([np.minimum(misfit, 10.0 * GATE), np.full((len(tau), len(tau)), GATE)], axis=1)
    rows, cols = scipy.optimize.linear_sum_assignment(cost)
    path = np.full(len(tau), -1)
    taken = cols < len(heard)
    path[rows[taken]] = received.path[heard[cols[taken]]]
    return path
