"""Landmarks: existence, strength, identity and occlusion of features, measurements predicted from them, and their
update."""
