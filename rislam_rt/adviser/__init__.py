"""Forecast of a run in a room before it is run: link budget of each landmark, remedies for those not detected, the RIS
panel's coverage, and the cost of tracing."""
