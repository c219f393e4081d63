"""The paper's particle filter: agent particles, each with clouds of landmark particles; the rest is the window's."""
