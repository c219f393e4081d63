"""The documentation builds as a site without a warning: every page is reached, every link leads somewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rislam_rt
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.settings_list import list_settings

ROOT = Path(__file__).parents[2]


def test_the_public_names_are_those_of_the_page_and_explained() -> None:
    page = re.findall(r"^::: ([\w.]+)\.(\w+)$", (ROOT / "docs" / "reference" / "api.md").read_text(), re.MULTILINE)
    cycle = ("init", "step", "predict", "estimate")  # too common as names of the package itself
    assert [name for home, name in page if home == "rislam_rt.slam" and name in cycle] == list(cycle)
    listed = {name: home for home, name in page if name not in ("errors", *cycle)}
    assert listed == rislam_rt._PUBLIC
    for name in rislam_rt._PUBLIC:
        found = getattr(rislam_rt, name)
        assert (found.__doc__ or "").strip(), name
        assert found.__name__ == name


PLAIN = f"""
INHERIT: {ROOT / "mkdocs.yml"}
docs_dir: {ROOT / "docs"}
hooks: [{ROOT / "docs" / "generated_pages.py"}]
plugins: []
"""
"""The site's settings without the docstrings and the search, which take two thirds of the time."""


@pytest.mark.parametrize("whole", [pytest.param(True, marks=pytest.mark.slow), False])
def test_the_site_builds_without_a_warning(tmp_path: Path, whole: bool) -> None:
    settings = ROOT / "mkdocs.yml" if whole else tmp_path / "plain.yml"
    if not whole:
        settings.write_text(PLAIN)
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    build += ["--config-file", str(settings)]
    done = subprocess.run(
        build,
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    pages = tmp_path / "site" / "reference"
    listed = (pages / "settings.html").read_text()
    assert all(f"<code>{one.key}</code>" in listed for one in list_settings(PipelineSpec))
    assert "run_slam" in (pages / "api.html").read_text()
    assert "runs/&lt;pipeline&gt;-" in (pages / "cli.html").read_text()
