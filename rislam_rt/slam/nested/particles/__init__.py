"""The belief of the nested filter: agent particles, clouds of landmark particles, and the engines that weigh them."""
