"""The scores of a run (agent, landmarks, walls, data association), and the posterior bounds of its errors."""
