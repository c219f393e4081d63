"""The score card of a study in unseen rooms: page, figure, tables."""

from rislam_rt.report.unseen.files import write_unseen

__all__ = ["write_unseen"]
