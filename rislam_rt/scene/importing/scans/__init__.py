"""Import of rooms from scans: planes of a noisy mesh, straight outlines of them, and what stands in the room."""
