"""The nested particle filter of the paper: agent particles, each with clouds of landmark particles."""
