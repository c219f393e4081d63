"""Long runs: simulated, written and scored in slices of some cycles, so that memory does not grow with the cycles."""
