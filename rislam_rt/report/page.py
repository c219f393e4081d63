"""The report page of a run: an HTML file with conclusions, map, figures and scores, and the figures as PNG files."""

import base64
import html
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.measurement import build_sensor
from rislam_rt.model import SlamResult
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.pipeline.scores.summary import DIVERGED
from rislam_rt.pipeline.scores.true_loss import FAR_OVER, LASTING, LOST
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.pipeline.specification.stored_spec import stored_spec
from rislam_rt.report.code_pictures import draw_run_codes
from rislam_rt.report.conclusions import judge_run
from rislam_rt.report.map_from_above import draw_above
from rislam_rt.report.room_figures import draw_paths
from rislam_rt.report.style import to_png
from rislam_rt.report.terminal_tables import summary_rows
from rislam_rt.report.time_curves import draw_agent_error, draw_landmark_errors, draw_levels, draw_timing
from rislam_rt.report.view.page import view_fragment, view_script, view_style
from rislam_rt.report.view.run_data import run_data
from rislam_rt.scene.check import faint_slabs
from rislam_rt.storage.files import write_atomic

PAGE = "report.html"

CAPTIONS = {
    "room": "The room from above, true and estimated. The close-up shows the end of the path with the 2σ ellipse that "
    "the filter believes in, unless it ends too far off for one. Walls are drawn dashed, "
    "as far as the room goes: where a plane ends is not estimated.",
    "error": "Distance between true and estimated position; dashed is the filter's own standard deviation.",
    "landmarks": "Distance between each landmark and the estimate that stands for it; a gap where there is none.",
    "levels": "Gain of the strongest path of each class, and its SNR over all antennas. The panel's direct path "
    "depends on the code: until the panel is in the map, designed codes are beams in search of it; most of them miss.",
    "paths": "Paths with at most one wall bounce, halfway through the run, with the levels of the first scheme.",
    "codes": "Phase levels of the panel over the run, and the gain of its direct path under them.",
    "timing": "Median of each step, with a whisker to the 99th percentile.",
}

STYLE = """
.verdict { font-size: 1.25rem; font-weight: 600; margin: 0.6rem 0; } .scroll { overflow-x: auto; }
ul { margin: 0.3rem 0; padding-left: 1.2rem; }
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 1080px; margin: 2rem auto; padding: 0 1rem; }
body { overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; margin-bottom: 0.2rem; } h2 { font-size: 1.1rem; margin-top: 2.2rem; }
img { max-width: 100%; height: auto; } figure { margin: 1.5rem 0; }
figcaption, .note { color: #555; font-size: 0.9rem; }
table { border-collapse: collapse; }
th, td { padding: 0.25rem 1rem 0.25rem 0; text-align: left; border-bottom: 1px solid #ddd; }
td:not(:first-child), th:not(:first-child) { text-align: right; }
td, th { overflow-wrap: normal; }
@media (max-width: 700px) { body > figure { overflow-x: auto; } body > figure img { max-width: none; width: 44rem; } }
"""


def write_report(result: SlamResult, summary: Mapping[str, Any], folder: Path) -> Path:
    """Write the report of a run, `figures/*.png` and `report.html`, into its folder; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    pictures = draw_figures(result)
    for name, picture in pictures.items():
        write_atomic(folder / "figures" / f"{name}.png", picture)
    page = folder / PAGE
    write_atomic(page, build_page(result, summary, pictures).encode())
    return page


def draw_figures(result: SlamResult) -> dict[str, bytes]:
    """Draw all figures of a run's report as PNG, by name, in the order of the page."""
    spec = stored_spec(result.config)
    settings = build_settings(spec)
    snr = 10.0 * float(np.log10(settings.radio.integrated_snr(np.ones(()))))
    threshold = 10.0 * float(np.log10(build_sensor(settings.radio, settings.receiver).threshold))
    budget = spec.budget
    cycle = len(result.scene.agent) // 2
    first = next(iter(result.schemes.values()))
    time = result.scene.agent.elapsed[cycle]
    figures = {
        "room": draw_above(result),
        "error": draw_agent_error(result),
        "landmarks": draw_landmark_errors(result),
        "levels": draw_levels(result, threshold, snr),
        "paths": draw_paths(
            result.scene, result.paths, np.abs(first.gain[cycle]), cycle,
            f"{result.scene.name} at t = {time:.1f} s ({result.paths.source})",
        ),
        "codes": draw_run_codes(result),
        "timing": draw_timing(
            result, (budget.optimise_s, budget.communicate_s, budget.measure_s, budget.localise_s)
        ),
    }  # fmt: skip
    return {name: to_png(figure) for name, figure in figures.items() if figure is not None}


def build_page(result: SlamResult, summary: Mapping[str, Any], pictures: Mapping[str, bytes]) -> str:
    """HTML page of a run's report, self-contained, with its figures, map, conclusions and scores."""
    title = f"{result.name} in {result.scene.name}"
    about = f"{summary['cycles']} cycles, seed {summary['seed']}, paths {result.paths.source} in "
    about += f"{summary['trace_seconds']:.1f} s."
    rows = "".join(f"<tr>{_elements('td', row)}</tr>" for row in summary_rows(summary))
    said, sentences = judge_run(result, summary), ""
    for name, text in said.schemes.items():
        lacks = [*said.lost[name], *(f"not found: {one}" for one in said.missing[name])]
        nested = f"<ul>{_elements('li', lacks)}</ul>" if lacks else ""
        sentences += f"<li>{html.escape(text)}{nested}</li>"
    figures = "".join(
        f'<figure><img alt="{html.escape(CAPTIONS[name])}" src="data:image/png;base64,'
        f'{base64.b64encode(picture).decode()}"><figcaption>{html.escape(CAPTIONS[name])}</figcaption></figure>'
        for name, picture in pictures.items()
    )
    radio = build_settings(stored_spec(result.config)).radio
    faint = (finding.line for finding in faint_slabs(result.scene, "scene/scene.toml", radio))
    lines = [*result.warnings, *faint]
    warnings = "".join(f'<p class="note">Warning: {html.escape(line)}</p>\n' for line in lines)
    versions = ", ".join(f"{name} {number}" for name, number in result.versions.items())
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title><style>{STYLE}{view_style()}</style></head><body>
<h1>{html.escape(title)}</h1>
<p class="verdict">{html.escape(said.headline)}</p>
<ul>{sentences}</ul>
{view_fragment(run_data(result))}
<p class="note">{html.escape(about)} The map: what each agent believed at a time; its codes; drag to turn.</p>
{warnings}{figures}
<h2>RMSE</h2>
<div class="scroll"><table><tr><th></th>{_elements("th", summary["schemes"])}</tr>{rows}</table></div>
<p class="note">Agent and landmarks: over the cycles (for a landmark, those in which the map holds it).
Relative to its start: without what the agent was told wrong of it
(within {100.0 * result.config["start"]["position_std_m"]:.3g} cm an axis), which no measurement can mend. Path aligned:
the estimated path shifted and turned onto the true one.
Walls, at the end: distance of the estimated plane over the true surface, and the angle between them; those in one
plane are one, and heard is one over which a path was loud enough for {HEARD:g} s in all. The bound is the
posterior bound of the same motion, codes and noise with landmarks and walls unknown. GOSPA is of the last map's points,
cut off at 1 m. Association: of the components taken for a landmark or wall, how many rightly (precision); of those
that came from one, how many were taken for it (recall). Budget: the settings <code>budget.*</code>, against the mean
time of each step on this machine. Diverged, by the truth: once off by more than {DIVERGED:g} m and {FAR_OVER:g}
bounds; without noticing, if the filter, which knows no truth, never held itself for lost. Lost: relative to its start
off by more than {LOST:g} m and {FAR_OVER:g} bounds for {LASTING:g} s on end; silently, if no cycle from then on says
so and the error is more than {FAR_OVER:g} of its own deviations, too.</p>
<h2>To repeat it</h2>
<p class="note">{html.escape(versions)}; scene SHA-256 {html.escape(result.scene.digest)}.
<code>rislam-rt run config.toml</code> in this folder does it again: all settings are there, the room in
<code>scene/</code>.</p>
<script>{view_script()}</script>
</body></html>
"""


def _elements(tag: str, texts: Iterable[str]) -> str:
    """HTML elements of a page, table cells or list items, that hold these texts."""
    return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts)
