"""Reports of the study in unseen rooms: score cards, page, figure, tables."""

from rislam_rt.report.unseen.files import write_unseen

__all__ = ["write_unseen"]
