"""Views in a browser: a room that turns with the paths of a pose, and a run with a slider over its time. Nothing is
loaded from anywhere: data, styles and script are in the page."""
