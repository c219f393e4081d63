"""The page and table of the paper's claims compared with our results."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rislam_rt.report.markdown import paragraph, table_lines
from rislam_rt.storage.files import csv_file, json_file, write_all
from rislam_rt.studies.claims import Claim


def write_claims(claims: Sequence[Claim], name: str, sources: Mapping[str, Any], folder: Path) -> Path:
    """Write the comparison of the paper's claims with our results as `<name>.md`, `.csv` and `.json`; return the page.

    Raises
    ------
    StoreError
        The disk refused.
    """
    content = {"sources": dict(sources), "claims": [claim._asdict() for claim in claims]}
    files = {
        f"{name}.md": claims_page(claims, sources).encode(),
        f"{name}.csv": csv_file(Claim._fields, claims),
        f"{name}.json": json_file(content, sort_keys=True),
    }
    return write_all(folder, files)


def claims_page(claims: Sequence[Claim], sources: Mapping[str, Any]) -> str:
    """Markdown page of the paper's claims compared with our results."""
    made = ", ".join(f"`{name}` (seed {about['seed']})" for name, about in sources.items())
    text = f"""From the results of {made}; written by `rislam-rt run` from one pipeline, do not edit. A claim
    without its SNR, start and motion says little: each is judged at every SNR of Fig. 4(b) and for each motion.
    Shares are those by which the RMSE with optimised codes is lower, with 95 % intervals from pairs of runs with
    the same motion and noise. `reproduced`: everywhere; `in part`: at some SNRs."""
    rows = [[c.claim, c.where, c.found or "-", f"**{c.verdict}**", c.reason or "-"] for c in claims]
    head = ["claim", "where", "found", "verdict", "why"]
    return "\n".join(["# The paper's claims", "", *paragraph(text), "", *table_lines(head, rows)]) + "\n"
