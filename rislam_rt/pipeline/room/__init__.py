"""The true room of a run: scene overrides, the agent's true motion, diffuse clutter, the receiver's real front end."""
