"""Reports: figures, terminal tables and HTML pages of runs, pages of studies, exports to other programs."""

from rislam_rt.report.page import draw_figures, write_report

__all__ = ["draw_figures", "write_report"]
