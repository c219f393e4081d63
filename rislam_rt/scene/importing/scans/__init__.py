"""Rooms from scans: levels, an outline that is straight, and what stands in it."""
