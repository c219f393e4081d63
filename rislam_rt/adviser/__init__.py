"""What a run in a room will hear, before it is run: link budget, what would help, the panel's coverage, the cost."""
