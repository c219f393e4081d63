"""Parts that rival SLAM schemes share: Gaussian sums given the agent's trajectory, association, ranges, report.

Nothing here belongs to one scheme; each scheme has a folder of its own beside this one.
"""
