"""Forecast of a run in a room: link budgets of landmarks, remedies, the RIS panel's coverage, cost of tracing."""
