"""Conclusions on a run in sentences, for the head of its page: errors, what was mapped, and why a landmark was not."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.measurement import build_sensor
from rislam_rt.model import PathKind, SchemeResult, SlamResult
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.pipeline.scores.loss_causes import UNNOTICED, is_unnoticed, words_of_loss
from rislam_rt.pipeline.scores.summary import panel_track
from rislam_rt.pipeline.scores.true_loss import words_of_silence
from rislam_rt.pipeline.scores.wall_scores import found_of_heard
from rislam_rt.pipeline.specification.pipeline_spec import Settings, build_settings
from rislam_rt.pipeline.specification.stored_spec import stored_spec
from rislam_rt.slam.step_info import StepOutcome

CODES = {"optimized": "optimised codes", "random": "random codes", "no_ris": "no panel", "exact": "exact codes"}
"""Schemes in words; others are called by their names."""
AT_BOUND = float(np.sqrt(-np.log(0.05)))
"""Largest ratio, 1.73, of RMSE to posterior bound at which a run counts as at the bound: for an efficient estimator
whose error along two axes is constant over the run (chi-square, two degrees of freedom), 95 % of runs lie below."""


class Conclusions(NamedTuple):
    """Sentences on a run: a headline, the results of each scheme, and the landmarks that each did not map."""

    headline: str
    """RMSE of all schemes in one sentence."""
    schemes: dict[str, str]
    """Results of each scheme, by name."""
    missing: dict[str, list[str]]
    """Landmarks that each scheme did not map, and why, by name."""
    lost: dict[str, list[str]]
    """When and why each scheme's filter held itself for lost, or that it diverged without noticing, by name; empty
    without either."""


def judge_run(result: SlamResult, summary: Mapping[str, Any]) -> Conclusions:
    """Conclusions on a run in sentences, from its scores and from the SNR of its paths."""
    found, missing, lost = {}, {}, {}
    for name, scheme in result.schemes.items():
        scores = summary["schemes"][name]
        found[name] = f"{_words(name)}: {_found(result, scheme, scores)}."
        missing[name] = list(_missing(result, scheme, scores))
        lost[name] = list(_lost(scores))
    return Conclusions(_headline(summary["schemes"]), found, missing, lost)


def _headline(schemes: Mapping[str, Any]) -> str:
    """Headline of a run's conclusions: `The agent is off by 2.7 cm with optimised codes, 6.7 cm with random ...`

    The error relative to the start stands beside it: of the other, most may be the start's own.
    """
    parts = [f"{_centimetres(scores['rmse_m'])} with {_words(name)}" for name, scores in schemes.items()]
    text = f"The agent is off by {', '.join(parts)} (RMSE)"
    known = [scores["relative_rmse_m"] for scores in schemes.values() if scores["relative_rmse_m"] is not None]
    if len(known) == len(schemes):
        text += f"; relative to its start by {', '.join(map(_centimetres, known))}"
    diverged = [_words(name) for name, scores in schemes.items() if scores["diverged"]]
    lost = [
        _words(name) for name, s in schemes.items() if not s["diverged"] and s["true_loss"] and s["true_loss"]["lost"]
    ]
    text += f"; diverged with {', '.join(diverged)}" if diverged else ""
    return text + (f"; lost with {', '.join(lost)}." if lost else ".")


def _found(result: SlamResult, scheme: SchemeResult, scores: Mapping[str, Any]) -> str:
    """Conclusion on one scheme in words: RMSE and bound, panel, scatterers and walls mapped."""
    parts = list(_errors(scores))
    panels = result.scene.panels if scheme.levels else ()
    for number, panel in enumerate(panels):
        found, name = panel_found_at(result, scheme, number), "panel" if len(panels) == 1 else panel.name
        parts.append(f"{name} not found" if found is None else f"{name} found after {found:.1f} s")
    names = [name for name in scores["landmarks"] if "cycles_identified" not in scores["landmarks"][name]]
    held = sum(scores["landmarks"][name]["final_m"] is not None for name in names)
    parts.append(f"{held} of {len(names)} scatterers")
    walls = found_of_heard(scores["walls"])  # of a run in slices, whatever was heard
    parts.append(f"{walls} walls" + (" that were heard" if " of " in walls else ""))
    return "; ".join(parts)


def _errors(scores: Mapping[str, Any]) -> Iterator[str]:
    """Conclusions on the errors of one scheme: RMSE, and RMSE relative to the start, each with its bound.

    Where the error relative to the start is known, it alone is held against its bound: the start's own error is in both
    the other and its bound, and may be most of them.
    """
    over, relative, least = scores["over_bound"], scores["relative_rmse_m"], scores["relative_bound_m"]
    near, known = bool(over) and over <= AT_BOUND, relative is not None and bool(least)
    bound = f"{_centimetres(scores['bound_m'])} would be possible" if scores["bound_m"] else "no bound"
    text = _centimetres(scores["rmse_m"])
    yield text if near and known else f"{text}, {'at the bound' if near else bound}"
    if known:
        yield f"{_centimetres(relative)} relative to its start, {relative / least:.1f} times the bound"


def panel_found_at(result: SlamResult, scheme: SchemeResult, panel: int = 0) -> float | None:
    """Conclusion when the panel was found: time [s] from which on, to the end, what a scheme's map holds for it lies by
    it; None if not then."""
    if panel >= len(result.scene.panels):
        return None
    known = panel_track(result.scene, scheme)[:, panel] >= 0
    if not len(known) or not known[-1]:
        return None
    gaps = np.flatnonzero(~known)
    first = int(gaps[-1]) + 1 if len(gaps) else 0
    time = result.scene.agent.time
    return float(time[first] - time[0])


def _lost(scores: Mapping[str, Any]) -> Iterator[str]:
    """Conclusions on the loss of one scheme: when and why its filter held itself for lost, and what it did not hear."""
    lost, outcomes = scores["lost"], scores["outcomes"]
    silent = outcomes.get(StepOutcome.NO_MEASUREMENTS, 0)
    if silent:
        yield f"nothing was heard in {silent} of {sum(outcomes.values())} cycles"
    if lost["times"]:
        often = "once, after" if lost["times"] == 1 else f"{lost['times']} times, first after"
        yield f"held itself for lost {often} {lost['first_s']:.1f} s: {words_of_loss(lost)}"
    if is_unnoticed(scores):
        yield UNNOTICED
    elif scores["true_loss"] and scores["true_loss"]["silent"]:
        yield words_of_silence(scores)


def _missing(result: SlamResult, scheme: SchemeResult, scores: Mapping[str, Any]) -> Iterator[str]:
    """Conclusions on landmarks that are missing in a scheme's last map, one line each, with the reason."""
    spec = stored_spec(result.config)
    settings = build_settings(spec, len(result.scene.panels) if scheme.levels else 0)
    threshold = build_sensor(settings.radio, settings.receiver).threshold
    paths = result.paths
    snr = np.where(paths.valid, settings.radio.integrated_snr(scheme.gain), 0.0)
    # what comes from below the array, or outside the receiver's window, is not heard however strong it is
    audible = audible_paths(replace(paths, gain=scheme.gain), settings, use_vt=True)
    valid = paths.valid & (audible | (snr < threshold))
    for number, (name, entry) in enumerate(scores["landmarks"].items()):
        panel = "cycles_identified" in entry
        if panel and (not scheme.levels or entry["identified_last"]):
            continue
        if entry["final_m"] is not None:
            if panel:
                yield f"{name}: a landmark lies there, which the map does not take for the panel"
            continue
        own = (paths.landmark == number) & (paths.kind != PathKind.LOS) & (paths.kind != PathKind.VT)
        loud = paths.valid[:, own] & (snr[:, own] >= threshold)
        unheard = "" if audible[:, own].any() else _why_unheard(paths.tau[:, own][loud], settings)
        yield f"{name}: {unheard or why_not(np.where(valid, snr, 0.0)[:, own], valid[:, own], threshold)}"


def _why_unheard(delay: Floats, settings: Settings) -> str:
    """Conclusion why loud paths of these delays (N,) [s] are not heard, in words: beyond the receiver's window, or from
    below the array; empty without any."""
    if not len(delay):
        return ""
    first, last = settings.sensor.window
    if (delay > last).all():
        late, most = f"{1e9 * delay.min():.3g}", f"{1e9 * last:.3g}"
        return f"never heard: its paths come in later than receiver.max_delay, {most} ns: after {late} ns or more"
    if (delay < first).all():
        soon, least = f"{1e9 * delay.max():.3g}", f"{1e9 * first:.3g}"
        return f"never heard: its paths come in before receiver.min_delay, {least} ns: after {soon} ns or less"
    if settings.sensor.in_window(delay).all():
        return "never heard: its paths come from below the array, which hears from above only"
    return "never heard: its paths come from below the array, or beyond the receiver's delays"


def why_not(snr: Any, valid: Booleans, threshold: float) -> str:
    """Conclusion why a landmark is not mapped, in words: no path, SNR below the threshold, or detected too seldom.

    `snr` and `valid` (K, P) are those of its paths, `threshold` that of detection; linear, over all antennas.
    """
    if not valid.any():
        return "no path reaches the agent"
    strongest = snr.max(axis=1)
    below = 10.0 * np.log10(threshold / max(float(strongest.max()), 1e-300))
    if below > 0.0:
        margin = f"{below:.0f}" if below >= 1.0 else f"{below:.1f}"
        return f"never heard: its strongest path stays {margin} dB below the threshold"
    heard = float(np.mean(strongest > threshold))
    if heard < 0.05:
        return f"heard in {100.0 * heard:.1f} % of the cycles only"
    return f"heard in {100.0 * heard:.0f} % of the cycles, and not in the map at the end"


def _words(name: str) -> str:
    """Name of a scheme in words, for conclusions."""
    return CODES.get(name, name)


def _centimetres(metres: float) -> str:
    """Length for conclusions, in centimetres, or in metres from one on, with two digits."""
    return f"{100.0 * metres:.2g} cm" if metres < 1.0 else f"{metres:.2g} m"
