"""Floor 8: figures, tables and the page of a run."""

from rislam_rt.report.page import draw_figures, write_report

__all__ = ["draw_figures", "write_report"]
