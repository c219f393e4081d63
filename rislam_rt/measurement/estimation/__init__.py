"""Estimation of paths from received samples: detected one by one by matched filter, then refined together."""
