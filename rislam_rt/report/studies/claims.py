"""The claims as a page and a table."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rislam_rt.report.swept.entries import paragraph, table_lines
from rislam_rt.storage.files import write_atomic
from rislam_rt.studies.claims import Claim
from rislam_rt.sweeps.record import json_bytes


def write_claims(claims: Sequence[Claim], name: str, sources: Mapping[str, Any], folder: Path) -> Path:
    """Write the claims as `<name>.md`, `.csv` and `.json`; returns the page.

    Raises
    ------
    StoreError
        The disk refused.
    """
    page = folder / f"{name}.md"  # first: the others are known as the program's by it
    write_atomic(page, claims_page(claims, sources).encode())
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(Claim._fields)
    table.writerows(claims)
    write_atomic(folder / f"{name}.csv", text.getvalue().encode())
    write_atomic(
        folder / f"{name}.json", json_bytes({"sources": dict(sources), "claims": [c._asdict() for c in claims]})
    )
    return page


def claims_page(claims: Sequence[Claim], sources: Mapping[str, Any]) -> str:
    """Markdown: one table of all claims."""
    made = ", ".join(f"`{name}` (seed {about['seed']})" for name, about in sources.items())
    text = f"""From the results of {made}; written by `rislam-rt run` from one pipeline, do not edit. A claim
    without its SNR, start and motion says little: each is judged at every SNR of Fig. 4(b) and for each motion.
    Shares are those by which the RMSE with optimised codes is lower, with 95 % intervals from pairs of runs with
    the same motion and noise. `reproduced`: everywhere; `in part`: at some SNRs."""
    rows = [[c.claim, c.where, c.found or "-", f"**{c.verdict}**", c.reason or "-"] for c in claims]
    head = ["claim", "where", "found", "verdict", "why"]
    return "\n".join(["# The paper's claims", "", *paragraph(text), "", *table_lines(head, rows)]) + "\n"
