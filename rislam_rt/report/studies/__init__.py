"""Pages, tables and figures of the studies that run in one piece, and of a sweep."""
