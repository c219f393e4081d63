"""What an estimator was given, as arrays and as files, and what any estimator makes of it."""
