"""The paper's claims compared with the results of other studies: claim, our figure, and whether it is reproduced."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError

FILES = ("fig4a.json", "fig4b.json", "fig4b_lively.json", "fig4c.json")
"""Result files of the studies that the claims are checked against, in the folder of the results."""
SOURCE = ("seed", "scenes", "versions")
"""Entries of each study's record that are repeated in the table of claims."""
LEAST_GAIN, LEAST_FALL = 0.31, 0.1
"""The paper's claims: RMSE below every benchmark's by this share, and below that without a panel by this much [m]."""
OURS, RIVALS = "optimized", ("random", "no_ris", "bp_slam", "channel_slam")
"""Scheme that the claims are about, and the benchmarks that it is compared with."""


class Claim(NamedTuple):
    """One claim of the paper, our result, and whether it is reproduced."""

    claim: str
    """In our words."""
    where: str
    """Place in the paper."""
    found: str
    """Our figure, with its confidence interval where it has one."""
    verdict: str
    """`reproduced`, `reproduced in part`, `not reproduced`, or `not known`."""
    reason: str


def read_results(folder: Path) -> dict[str, Mapping[str, Any]]:
    """Read the result files of the studies against which the paper's claims are held, in a folder, by the name of the
    study.

    Raises
    ------
    ConfigError
        There is none of them, or one cannot be read.
    """
    found = {}
    for name in FILES:
        file = folder / name
        if not file.is_file():
            continue
        try:
            found[file.stem] = json.loads(file.read_text(encoding="utf-8"))
            judge(found)  # each is held against its own form as it is read, so that what is wrong has a name
            if not all(key in found[file.stem] for key in SOURCE):
                raise ValueError(f"{', '.join(SOURCE)}: not all there")
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            cause = " ".join(f"{type(error).__name__}: {error}".split())[:80]
            raise ConfigError(
                f"results: {file} is not what its study writes ({cause}); run pipelines/{file.stem}.toml again"
            ) from None
    if not found:
        raise ConfigError(f"results: {folder} has none of {', '.join(FILES)}; run pipelines/fig4b.toml and the others")
    return found


def judge(results: Mapping[str, Mapping[str, Any]]) -> list[Claim]:
    """Compare all claims of the paper with the studies' results, in the order of the paper."""
    curves = [content for name, content in results.items() if name.startswith("fig4b")]
    gains, entries = ([entry for content in curves for entry in content[part]] for part in ("gains", "entries"))
    cases = list(dict.fromkeys(gain["case"] for gain in gains))
    found = [*_fig4a(results.get("fig4a"))]
    for case in cases:
        own = [gain for gain in gains if gain["case"] == case]
        mine = [entry for entry in entries if entry["case"] == case]
        found += [_lowest(case, own), _share(case, own), _metres(case, own), *_with_snr(case, mine)]
    if not cases:
        found.append(_unknown("error at least 31 % lower than every benchmark's", "abstract, Fig. 4(b)", "fig4b"))
    return [*found, *_fig4c(results.get("fig4c"))]


def _fig4a(content: Mapping[str, Any] | None) -> list[Claim]:
    """Check the claims on the panel's gain at every place and element pattern of Fig. 4(a)."""
    where = "Fig. 4(a)"
    claims = ("optimised above random codes, intervals apart", "optimised above the sphere")
    if content is None:
        return [_unknown(claim, where, "fig4a") for claim in claims]
    places = len(content["distance_m"])
    found = []
    for claim in claims:
        held = {element: int(own["holds_at"][claim]) for element, own in content["elements"].items()}
        text = ", ".join(f"at {count} of {places} places with element pattern {name}" for name, count in held.items())
        verdict = _judgement([count == places for count in held.values()], any(held.values()))
        reason = "Gain of the direct path over the panel; the optimum over all codes is known exactly and is near."
        found.append(Claim(f"gain of the panel: {claim}", where, text, verdict, reason))
    return found


def _lowest(case: str, gains: Sequence[Mapping[str, Any]]) -> Claim:
    """Check the claim that the optimised codes have the lowest RMSE of all schemes at every SNR."""
    known = [gain for gain in gains if gain["over"] in RIVALS and gain["gain"] is not None]
    above = [gain for gain in known if gain["gain_low"] > 0.0]
    below = [gain for gain in known if gain["gain_high"] < 0.0]
    text = (
        f"lower, interval above 0, in {len(above)} of {len(known)} pairs of SNR and benchmark; higher in {len(below)}"
    )
    verdict = _judgement([len(above) == len(known)], bool(above)) if known else "not known"
    rest = ", ".join(f"{gain['over']} at {gain['snr_db']:g} dB" for gain in known if gain not in above)
    reason = "" if len(above) == len(known) else f"No telling or worse: {rest}. {_bounds(known, above)}"
    return Claim(f"lowest error of all schemes at every SNR ({case})", "Fig. 4(b)", text, verdict, reason)


def _share(case: str, gains: Sequence[Mapping[str, Any]]) -> Claim:
    """Check the claim of an RMSE 31 % below every benchmark's, SNR by SNR."""
    rows, held = [], []
    for snr, own in _by_snr(gains):
        least = min(own, key=lambda gain: gain["gain"])
        held.append(least["gain"] >= LEAST_GAIN)
        value, low, high = (100 * least[name] for name in ("gain", "gain_low", "gain_high"))
        rows.append(f"{snr:g} dB: {value:.0f} % ({low:.0f} to {high:.0f}) over {least['over']}")
    verdict = _judgement(held, any(held)) if held else "not known"
    limits = [
        f"{snr:g} dB {100 * min(gain['bound_gain'] for gain in own):.0f} %"
        for snr, own in _by_snr(gains)
        if all(gain["bound_gain"] is not None for gain in own)
    ]
    reason = f"The posterior bounds of the same codes leave room for {', '.join(limits)}." if limits else ""
    return Claim(
        f"error at least 31 % lower than every benchmark's ({case})", "abstract, Fig. 4(b)",
        "; ".join(rows), verdict, reason,
    )  # fmt: skip


def _metres(case: str, gains: Sequence[Mapping[str, Any]]) -> Claim:
    """Check the claim of an RMSE 0.1 m below that of the scheme without a panel."""
    own = [gain for gain in gains if gain["over"] == "no_ris" and gain["lower_by_m"] is not None]
    held = [gain["lower_by_m"] >= LEAST_FALL for gain in own]
    text = "; ".join(
        f"{gain['snr_db']:g} dB: {gain['lower_by_m']:.3f} m ({gain['lower_by_low_m']:.3f} to "
        f"{gain['lower_by_high_m']:.3f})"
        for gain in own
    )
    verdict = _judgement(held, any(held)) if held else "not known"
    reason = "The difference is a matter of scale: it grows with the motion's acceleration and the start's errors."
    return Claim(f"error about 0.1 m lower than without a panel ({case})", "Fig. 4(b)", text, verdict, reason)


def _with_snr(case: str, entries: Sequence[Mapping[str, Any]]) -> list[Claim]:
    """Check the claim that the RMSE falls as the SNR grows."""
    own = sorted((e for e in entries if e["scheme"] == OURS and e["rmse_m"]), key=lambda e: float(e["snr_db"]))
    if len(own) < 2:
        return []
    steps = [after["rmse_m"] <= before["rmse_m"] for before, after in pairwise(own)]
    text = ", ".join(f"{entry['snr_db']:g} dB: {entry['rmse_m']:.3f} m" for entry in own)
    over = ", ".join(f"{e['snr_db']:g} dB {e['over_bound']:.2f}" for e in own if e.get("over_bound") is not None)
    reason = f"RMSE over its posterior bound: {over}. The start's own error is in both, and nothing removes it."
    return [Claim(f"error falls as the SNR grows ({case})", "Fig. 4(b)", text, _judgement(steps, any(steps)), reason)]


def _fig4c(content: Mapping[str, Any] | None) -> list[Claim]:
    """Claims that the RMSE of agent and panel fall with the panel's size, by Fig. 4(c)."""
    where = "Fig. 4(c)"
    what = {"agent": "agent's error falls with the panel's size", "panel": "panel's error falls with the panel's size"}
    own = [] if content is None else [fall for fall in content["falls"] if fall["scheme"] == OURS]
    if content is None or not own:
        return [_unknown(claim, where, "fig4c") for claim in what.values()]
    sizes = sorted({entry["size"] for entry in content["entries"]})
    found = []
    for name, claim in what.items():
        fall, low, high = (own[0][f"{name}{end}"] for end in ("", "_low", "_high"))
        if fall is None:
            found.append(_unknown(claim, where, "fig4c"))
            continue
        text = f"lower by {100 * fall:.0f} % ({100 * low:.0f} to {100 * high:.0f}) with {sizes[-1]} x {sizes[-1]} than "
        text += f"with {sizes[0]} x {sizes[0]} elements"
        column = "rmse_m" if name == "agent" else "panel_m"
        course = sorted(
            (e["size"], e[column]) for e in content["entries"] if e["scheme"] == OURS and e[column] is not None
        )
        steps = [after <= before for (_, before), (_, after) in pairwise(course)]
        verdict = _judgement([low > 0.0, *steps], low > 0.0)
        reason = "By size: " + ", ".join(f"{size} x {size} {value:.3f} m" for size, value in course) + "."
        found.append(Claim(claim, where, text, verdict, reason))
    return found


def _by_snr(gains: Sequence[Mapping[str, Any]]) -> list[tuple[float, list[Mapping[str, Any]]]]:
    """Gains over the benchmarks that the paper claims, grouped by SNR [dB]."""
    known = [gain for gain in gains if gain["over"] in RIVALS and gain["gain"] is not None]
    return [(snr, [g for g in known if g["snr_db"] == snr]) for snr in dict.fromkeys(g["snr_db"] for g in known)]


def _bounds(known: Sequence[Mapping[str, Any]], above: Sequence[Mapping[str, Any]]) -> str:
    """Differences of the posterior bounds where the claimed order of the curves does not hold, as text."""
    limits = [gain["bound_gain"] for gain in known if gain not in above and gain["bound_gain"] is not None]
    if not limits:
        return ""
    low, high = (f"{100 * limit:.0f}" for limit in (min(limits), max(limits)))
    return f"There the bounds differ by {low if low == high else f'{low} to {high}'} %."


def _judgement(held: Sequence[bool], some: bool) -> str:
    """Whether a claim is reproduced, in part or not, in words."""
    if all(held):
        return "reproduced"
    return "reproduced in part" if some else "not reproduced"


def _unknown(claim: str, where: str, study: str) -> Claim:
    """A claim whose study has no results."""
    return Claim(claim, where, "", "not known", f"`pipelines/{study}.toml` has not been run, or not to the end.")
