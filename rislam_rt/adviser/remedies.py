"""Remedies for a landmark that is not detected: a larger panel or scatterer, less noise, a nearer trajectory."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rislam_rt.adviser.link_budget import OUTSIDE, WEAK, LandmarkLink, Survey
from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.antennas import amplitude
from rislam_rt.design import exact_code
from rislam_rt.geometry.angles import unit
from rislam_rt.model import RisPanel, RisSpec
from rislam_rt.ris import leg_response

HEARD, SELDOM = 0.5, 0.05
"""Shares of the trajectory from which on a landmark counts as detected, and up to which as not detected."""
LARGEST = 128
"""Elements along a side of the largest RIS panel that is proposed."""
GROWTH = 1.05
"""Factor from one panel size tried to the next, once the law for a continuous phase has said where to begin."""


def detection_label(link: LandmarkLink) -> str:
    """Label that the adviser gives a landmark, by which it picks remedies: `heard`, `heard at times` or `not heard`."""
    return "heard" if link.share >= HEARD else "heard at times" if link.share >= SELDOM else "not heard"


def remedies(looked: Survey, links: Sequence[LandmarkLink]) -> list[str]:
    """Lines on what would help each landmark heard on less than half of the way, and panels hardly found by a sweep."""
    lines = []
    for link in links:
        if link.code in ("", "aimed") and link.share < HEARD:
            heard = f"{detection_label(link)} (on {link.share:.0%} of the way)"
            lines.append(f"{link.landmark}: {heard}: {_what_helps(looked, link)}")
    for link in links:
        known = any(one.share >= HEARD for one in links if (one.landmark, one.code) == (link.landmark, "aimed"))
        if link.code == "swept" and link.share < SELDOM and known:
            lines.append(
                f"{link.landmark}: heard once it is known, but the beams that look for it are heard in "
                f"{link.share:.1%} of the cycles only: it may be found late or never"
            )
    return lines


def weak_places(link: LandmarkLink) -> Integers:
    """Indices of a link budget's positions at which a remedy of more SNR helps: a path comes in that is only too
    weak."""
    return np.array([place for place, reason in enumerate(link.reason) if reason == WEAK], dtype=np.int64)


def lack_db(link: LandmarkLink) -> float:
    """SNR [dB] that remedies must add for a landmark to be detected, the median where it is too weak; 0 without any."""
    weak = weak_places(link)
    return -float(np.median(link.margin_db[weak])) if len(weak) else 0.0


def enough_elements(looked: Survey, panel: RisPanel, link: LandmarkLink) -> RisSpec | None:
    """Remedy of a larger RIS panel: the smallest, grown alike along both sides, whose direct path under the best code
    is above the detection threshold at the median of the positions."""
    spec, weak = panel.spec, weak_places(link)
    scale = 10.0 ** (lack_db(link) / 40.0) * 0.9  # the amplitude goes with the sides' product
    while True:
        rows, cols = (max(count, int(np.ceil(count * scale))) for count in (spec.rows, spec.cols))
        if max(rows, cols) > LARGEST:
            return None
        grown = replace(spec, rows=rows, cols=cols)
        if float(np.median(_margins(looked, panel, grown)[weak])) >= 0.0:
            return grown
        scale *= GROWTH


def _what_helps(looked: Survey, link: LandmarkLink) -> str:
    """Text on a landmark that is not detected: reasons, the commonest first, remedies, the SNR it lacks, and what makes
    up for it."""
    scene, lack, parts = looked.scene, lack_db(link), []
    held = bool(link.code) and not looked.settings.receiver.alternation
    for reason, count in Counter(reason for reason in link.reason if reason).most_common():
        share = f"{reason} on {count / len(link.reason):.0%} of it"
        parts.append(share if reason == WEAK else f"{share} ({_way_round(reason, panel_held=held)})")
    if lack:
        parts.append(f"{lack:.1f} dB lack where it is too weak: as much less noise (radio.reference_snr_db) would do")
        parts += _larger(looked, link, lack)
        point = scene.landmark_positions[scene.landmarks.index(link.landmark)]
        weak = scene.agent.position[weak_places(link)]
        far = float(np.median(np.linalg.norm(weak - point, axis=1)))
        parts.append(f"or a way within {far * 10.0 ** (-lack / 40.0):.1f} m (there it is {far:.1f} m away)")
    return "; ".join(parts)


def _larger(looked: Survey, link: LandmarkLink, lack: float) -> Iterator[str]:
    """Remedy by size for a lack [dB]: the cross-section of a scatterer, or the elements of a RIS panel."""
    scene = looked.scene
    if link.code == "":
        yield f"or an echo of {10.0 ** (lack / 10.0):.2g} times the cross-section"
        return
    panel = next(one for one in scene.panels if one.name == link.landmark)
    spec, grown = panel.spec, enough_elements(looked, panel, link)
    now = f"(now {spec.rows} x {spec.cols})"
    if grown:
        yield f"or a panel of {grown.rows} x {grown.cols} elements {now}"
    else:
        yield f"no panel of up to {LARGEST} elements a side would do {now}"


def _way_round(why: str, *, panel_held: bool) -> str:
    """Remedy for a reason other than a weak path; `panel_held`: a RIS panel with one code for the whole slot."""
    if "behind the panel" in why:
        return "turn the panel, or lead the way before it"
    if "shaded" in why:
        return "move the one or the other, or lead the way around"
    if "below" in why:
        return "raise it, lower the agent, or take radio.array.pattern = 'isotropic'"
    if why == OUTSIDE:
        return "a larger receiver.max_delay, or lead the way nearer"
    if "told from" in why:
        return "more bandwidth or antennas" + (", or receiver.alternation = true" if panel_held else "")
    return "lead the way to where it is seen"


def _margins(looked: Survey, panel: RisPanel, spec: RisSpec) -> Floats:
    """Margin (K,) [dB], for remedies, of a RIS panel's unhindered direct path under the best code for a data sheet."""
    radio, agent = looked.settings.radio, looked.scene.agent
    ends, patterns = ((agent.tx, radio.tx_gain), (agent.rx, radio.rx_gain)), (radio.antennas.tx, radio.antennas.rx)
    tx, rx = (
        leg_response(
            spec, panel.center, end, np.sqrt(gain) * amplitude(pattern, unit(panel.center - end), agent.heading) + 0j,
            radio.wavelength,
        )
        for (end, gain), pattern in zip(ends, patterns, strict=True)
    )  # fmt: skip
    _, gain = exact_code((tx * rx).reshape(len(agent), -1), spec.levels)
    snr = radio.integrated_snr(gain) / looked.settings.sensor.threshold
    return np.asarray(10.0 * np.log10(np.maximum(snr, 1e-40)))
