"""Runs of many cycles: led, written and scored slice by slice."""
