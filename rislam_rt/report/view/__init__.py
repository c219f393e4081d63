"""Interactive views for the browser: a rotatable room with the paths at a pose, and a run with a slider over time.

Data, styles and script are all in the page: nothing is loaded.
"""
