"""Floor 4: propagation paths of a true room, traced or by images, behind one protocol.

`protocol.py` says what a channel is, `walls.py` numbers the walls, `legs.py` and `path_composition.py` join specular
legs into paths; both channels differ only in how they find the legs.
"""
