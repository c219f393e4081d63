"""Motion of the agent in a scene: along a line or waypoints, recorded, drawn at random, or suggested for a room."""
