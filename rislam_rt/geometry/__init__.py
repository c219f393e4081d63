"""Floor 1: pure functions of points, directions, planes, triangles, mirror chains, bistatic paths. No types of ours."""
