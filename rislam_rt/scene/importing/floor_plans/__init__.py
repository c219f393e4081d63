"""Import of rooms from floor plans, corners, GeoJSON or SVG: the walls of the plan, extruded to a room."""
