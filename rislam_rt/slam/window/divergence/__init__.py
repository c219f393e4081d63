"""Divergence: whether the filter has lost the agent, and how its belief then recovers."""
