"""Specification of pipeline files: their tables and settings, ranges and defaults, and how they are read."""
