"""How the agent moves: motion modes that are learnt, turns with the body, manoeuvres that no step tells of, and what
path lengths tell of the way."""
