"""The paper's nested particle filter: agent particles, each with clouds of landmark particles, behind the window's front end."""
