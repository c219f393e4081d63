"""What would help a landmark that is not heard: a larger panel or scatterer, less noise, a nearer way."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design import exact_code
from rislam_rt.model import PathKind, RisPanel, RisSpec
from rislam_rt.pipeline.advise.budget import NOTHING_DB, Link, Survey
from rislam_rt.ris import leg_response

HEARD, SELDOM = 0.5, 0.05
"""Shares of the way from which on a landmark counts as heard, and up to which as not heard; between, at times."""
LARGEST = 128
"""Elements a side of the largest panel that is proposed."""
GROWTH = 1.05
"""From one size tried to the next, once the law for a continuous phase has said where to begin."""


def verdict(link: Link) -> str:
    """`heard`, `heard at times` or `not heard`."""
    return "heard" if link.share >= HEARD else "heard at times" if link.share >= SELDOM else "not heard"


def remedies(looked: Survey, links: Sequence[Link]) -> list[str]:
    """One line for each landmark that is not heard on half of the way under the best code, and one on finding it."""
    lines = []
    for link in links:
        if link.code in ("", "aimed") and link.share < HEARD:
            lines.append(f"{link.landmark}: {verdict(link)} ({link.share:.0%} of the way): {_what_helps(looked, link)}")
    lines += [line for link in links if link.code == "swept" for line in _on_search(link, links)]
    return lines


def lack_db(link: Link) -> float | None:
    """By how much the median place with a path lacks SNR [dB]; 0 if it does not, None without any path."""
    there = link.margin_db[link.margin_db > NOTHING_DB]
    return max(0.0, -float(np.median(there))) if len(there) else None


def enough_elements(looked: Survey, panel: RisPanel, lack: float) -> RisSpec | None:
    """The smallest panel, grown alike along both sides, whose direct path under the best code is above the threshold at
    the median place that sees it; None if none of up to `LARGEST` elements a side is. `lack` [dB]: where to begin.
    """
    spec, seen = panel.spec, _direct_places(looked)
    if not len(seen):
        return None
    scale = 10.0 ** (max(lack, 0.0) / 40.0) * 0.9  # the amplitude goes with the sides' product
    while True:
        rows, cols = (max(count, int(np.ceil(count * scale))) for count in (spec.rows, spec.cols))
        if max(rows, cols) > LARGEST:
            return None
        grown = replace(spec, rows=rows, cols=cols)
        if float(np.median(_margins(looked, panel, grown)[seen])) >= 0.0:
            return grown
        scale *= GROWTH


def _what_helps(looked: Survey, link: Link) -> str:
    scene, lack = looked.scene, lack_db(link)
    why = _main_reason(link)
    if lack is None or (lack == 0.0 and why):
        return f"{why}; {_way_round(why)}"
    parts = [f"{lack:.1f} dB lack at the median place"] if lack > 0.0 else []
    if why and why != "too weak":
        parts.append(why)
    parts.append(f"{lack:.1f} dB less noise would do (radio.reference_snr_db)" if lack else _way_round(why))
    if lack:
        parts += _larger(looked, link, lack)
        point = scene.landmark_positions[scene.landmarks.index(link.landmark)]
        far = float(np.median(np.linalg.norm(scene.agent.position - point, axis=1)))
        parts.append(f"or a way within {far * 10.0 ** (-lack / 40.0):.1f} m (now {far:.1f} m)")
    return "; ".join(parts)


def _larger(looked: Survey, link: Link, lack: float) -> Iterator[str]:
    scene = looked.scene
    if link.code == "":
        yield f"or an echo of {10.0 ** (lack / 10.0):.2g} times the cross-section"
        return
    assert scene.ris is not None
    spec = scene.ris.spec
    grown = enough_elements(looked, scene.ris, lack)
    now = f"(now {spec.rows} x {spec.cols})"
    yield (
        f"or a panel of {grown.rows} x {grown.cols} elements {now}"
        if grown
        else (f"no panel of up to {LARGEST} elements a side would do {now}")
    )


def _on_search(link: Link, links: Sequence[Link]) -> Iterator[str]:
    """A panel that an aimed code makes heard, but the sweep hardly ever hits."""
    aimed = next(one for one in links if one.landmark == link.landmark and one.code == "aimed")
    if aimed.share >= HEARD and link.share < SELDOM:
        yield (
            f"{link.landmark}: heard once it is known, but the beams that look for it are heard in {link.share:.1%} of "
            "the cycles only: it may be found late or never"
        )


def _main_reason(link: Link) -> str:
    """The reason given most often."""
    said = [reason for reason in link.reason if reason]
    return max(said, key=said.count) if said else ""


def _way_round(why: str) -> str:
    if "behind the panel" in why:
        return "turn the panel, or lead the way before it"
    if "shaded" in why:
        return "move the one or the other, or lead the way around"
    if "below" in why:
        return "raise it, lower the agent, or take radio.array.pattern = 'isotropic'"
    if "told from" in why:
        return "more bandwidth or antennas, or receiver.alternation for a panel"
    return "lead the way nearer"


def _direct_places(looked: Survey) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """Places at which the panel's direct path comes in."""
    direct = looked.paths.kind == PathKind.RIS
    return np.flatnonzero(looked.paths.valid[:, direct].any(axis=1))


def _margins(looked: Survey, panel: RisPanel, spec: RisSpec) -> Floats:
    """(K,) SNR over the threshold [dB] of the direct path under the best code, as if nothing were in its way."""
    radio, agent = looked.settings.radio, looked.scene.agent
    tx, rx = (
        leg_response(spec, panel.center, end, np.sqrt(np.full(len(end), gain, dtype=np.complex128)), radio.wavelength)
        for end, gain in ((agent.tx, radio.tx_gain), (agent.rx, radio.rx_gain))
    )
    _, gain = exact_code((tx * rx).reshape(len(agent), -1), spec.levels)
    snr = radio.integrated_snr(gain) / looked.settings.sensor.threshold
    return np.asarray(10.0 * np.log10(np.maximum(snr, 1e-40)))
