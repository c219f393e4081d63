"""Swept studies as figures, tables and pages."""

from rislam_rt.report.swept.files import write_swept

__all__ = ["write_swept"]
