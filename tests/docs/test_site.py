"""The documentation builds as a site without a warning: every page is reached, every link leads somewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import rislam_rt
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.settings_list import list_settings

ROOT = Path(__file__).parents[2]


def test_the_public_names_are_those_of_the_page_and_explained() -> None:
    page = re.findall(r"^::: ([\w.]+)\.(\w+)$", (ROOT / "docs" / "reference" / "api.md").read_text(), re.MULTILINE)
    listed = {name: home for home, name in page if name != "errors"}
    assert listed == rislam_rt._PUBLIC
    for name in rislam_rt._PUBLIC:
        found = getattr(rislam_rt, name)
        assert (found.__doc__ or "").strip(), name
        assert found.__name__ == name


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(
        build,
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    settings = (tmp_path / "reference" / "settings.html").read_text()
    assert all(f"<code>{one.key}</code>" in settings for one in list_settings(PipelineSpec))
    assert "run_slam" in (tmp_path / "reference" / "api.html").read_text()
    assert "runs/&lt;pipeline&gt;-" in (tmp_path / "reference" / "cli.html").read_text()
