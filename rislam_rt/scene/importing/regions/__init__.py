"""The flat and round regions of a mesh, grouped into walls and things, and made of as few faces as will do."""
