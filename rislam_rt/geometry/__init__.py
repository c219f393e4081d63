"""Floor 1: pure functions on points, directions, planes and triangles. No data types of ours."""
