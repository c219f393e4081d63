"""The run folder: all files of a run, and the identity (hash of settings, scene, code) by which it is recognised."""
