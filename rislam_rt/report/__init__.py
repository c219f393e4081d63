"""Reports: figures, terminal tables and HTML pages of runs, pages of studies, exports to other programs.

Names are imported when first used, so that a table on the terminal loads nothing that draws.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rislam_rt.report.page import draw_figures, write_report

__all__ = ["draw_figures", "write_report"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from rislam_rt.report import page

        return getattr(page, name)
    raise AttributeError(f"module 'rislam_rt.report' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
