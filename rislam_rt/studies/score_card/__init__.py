"""Score cards of estimators in runs of any room: the truth to score against, scores, recordings of runs."""
