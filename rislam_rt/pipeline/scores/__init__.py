"""The scores of a run, and the posterior bounds beside them."""
