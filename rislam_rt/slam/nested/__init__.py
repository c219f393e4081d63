"""The paper's nested particle filter: agent particles with clouds of landmark particles; births are the window's."""
