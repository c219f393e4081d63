"""What the rivals share: Gaussian sums on the agent's course, loopy association, ranges, resampling, the report.

Nothing here belongs to one scheme; each scheme has a folder of its own beside this one.
"""
