"""HTML page of an interactive view, or a fragment of it for another page."""

import html
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Any

from rislam_rt.storage.files import MARK

SCRIPTS = ("space.js", "draw.js", "view.js", "beliefs.js", "start.js")
"""Scripts of a view in the order in which they need each other; the last starts all views of a page."""


def view_fragment(data: Mapping[str, Any]) -> str:
    """HTML element with the data of an interactive view; its page needs `view_style` and, after it, `view_script`."""
    # inside a script element only `</` could end it, and `<!--` confuse it; both are strings' business in JSON
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        f'<div class="rv"><script type="application/json">{text}</script>'
        "<noscript>This view needs JavaScript, which is in the page itself.</noscript></div>"
    )


def view_style() -> str:
    """CSS style sheet of the interactive views."""
    return _asset("viewer.css")


def view_script() -> str:
    """JavaScript of the interactive views."""
    return "\n".join(_asset(name) for name in SCRIPTS)


def view_page(title: str, about: str, data: Mapping[str, Any]) -> str:
    """HTML page with one interactive view, self-contained."""
    return _asset("page.html").format(
        mark=MARK, title=html.escape(title), about=html.escape(about), style=view_style(), view=view_fragment(data),
        script=view_script(),
    )  # fmt: skip


@lru_cache(maxsize=16)
def _asset(name: str) -> str:
    """Text of a file (script or style) for the HTML page of a view."""
    return files("rislam_rt.report.view").joinpath(name).read_text(encoding="utf-8")
