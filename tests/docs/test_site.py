"""The documentation builds as a site without a warning: every page is reached, every link leads somewhere."""

import os
import subprocess
import sys
from pathlib import Path

from rislam_rt.pipeline.settings import list_settings
from rislam_rt.pipeline.spec import PipelineSpec

ROOT = Path(__file__).parents[2]


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
