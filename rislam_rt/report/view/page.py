"""The view as HTML: a fragment for a page that has others things too, or a page of its own."""

import html
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Any

from rislam_rt.storage.files import MARK

SCRIPTS = ("space.js", "draw.js", "view.js", "beliefs.js", "start.js")
"""In the order of their needs; the last finds the views of a page and starts them."""


def view_fragment(data: Mapping[str, Any]) -> str:
    """The element that becomes a view; the page needs `view_style` and, after it, `view_script` once."""
    # inside a script element only `</` could end it, and `<!--` confuse it; both are strings' business in JSON
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        f'<div class="rv"><script type="application/json">{text}</script>'
        "<noscript>This view needs JavaScript, which is in the page itself.</noscript></div>"
    )


def view_style() -> str:
    """Style sheet of the views."""
    return _asset("viewer.css")


def view_script() -> str:
    """Script of the views."""
    return "\n".join(_asset(name) for name in SCRIPTS)


def view_page(title: str, about: str, data: Mapping[str, Any]) -> str:
    """A page of its own."""
    return _asset("page.html").format(
        mark=MARK,
        title=html.escape(title),
        about=html.escape(about),
        style=view_style(),
        view=view_fragment(data),
        script=view_script(),
    )


@lru_cache(maxsize=16)
def _asset(name: str) -> str:
    return files("rislam_rt.report.view").joinpath(name).read_text(encoding="utf-8")
