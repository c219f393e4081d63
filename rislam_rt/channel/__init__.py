"""Floor 4: propagation channels of the true room, ray-traced (Sionna RT) or by the image-source method.

`protocol.py` is their common interface, `walls.py` numbers the walls, `specular_legs.py` and `path_composition.py` join
specular legs into paths; both channels differ only in how they find the legs.
"""
