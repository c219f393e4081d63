"""The true side of a run beside its paths: what is changed in the room, how the agent moves, what the receiver is."""
