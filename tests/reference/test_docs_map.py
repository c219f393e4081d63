"""The map from equations to functions names things that exist."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAMES = sorted(set(re.findall(r"`(rislam_rt\.[\w.]+)`", (ROOT / "docs" / "paper_map.md").read_text())))


@pytest.mark.parametrize("name", NAMES)
def test_name_exists(name):
    module, _, attribute = name.rpartition(".")
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        assert hasattr(importlib.import_module(module), attribute)


MADE_WITH_THE_SITE = ("reference/settings.md", "reference/cli.md")
"""Pages that `docs/generated_pages.py` writes; `tests/docs` builds the site."""


def test_every_link_of_the_docs_leads_somewhere():
    for page in [*ROOT.glob("docs/**/*.md"), ROOT / "README.md"]:
        for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            target = (page.parent / link).resolve()
            made = target in [ROOT / "docs" / name for name in MADE_WITH_THE_SITE]
            assert made or target.exists(), f"{page.name}: {link}"
