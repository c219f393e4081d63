"""Writing the files of the channel comparison and of Fig. 4(a): page, data and figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rislam_rt.report.studies.channel_validation import validation_page
from rislam_rt.report.studies.channel_validation_figure import draw_certificate
from rislam_rt.report.studies.fig4a import draw_fig4a, fig4a_csv, fig4a_page
from rislam_rt.report.style import to_png
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.compare import Comparison
from rislam_rt.studies.fig4a import Fig4a
from rislam_rt.studies.spec import CompareSpec, Fig4aSpec

COMPARISON, CERTIFICATE = "channel_validation", "figures/path_certificate.png"
CURVES, CURVES_FIGURE = "fig4a", "figures/fig4a.png"


def write_comparison(
    found: Comparison, spec: CompareSpec, content: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path:
    """Write the files of a comparison of both channels: page, JSON and figure; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    files = {f"{COMPARISON}.md": validation_page(found.rows, seed=spec.seed).encode()}
    if figures and found.certificate is not None:
        files[CERTIFICATE] = to_png(draw_certificate(found.certificate))
    return write_all(folder, files | {f"{COMPARISON}.json": json_file(content)})


def write_fig4a(
    found: Fig4a, spec: Fig4aSpec, scene: str, content: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path:
    """Write the files of Fig. 4(a): page, CSV, JSON and figure; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    page = fig4a_page(found, spec, scene, CURVES_FIGURE if figures else None)
    files = {f"{CURVES}.md": page.encode(), f"{CURVES}.csv": fig4a_csv(found)}
    if figures:
        files[CURVES_FIGURE] = to_png(draw_fig4a(found, spec))
    return write_all(folder, files | {f"{CURVES}.json": json_file(content)})
