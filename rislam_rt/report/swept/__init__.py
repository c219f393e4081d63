"""Figures, tables and pages of swept studies: Fig. 4(b) and (c), rooms, ablations, robustness, hardware."""

from rislam_rt.report.swept.files import write_swept

__all__ = ["write_swept"]
