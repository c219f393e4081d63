"""Files on disk: written whole or not at all, folders locked by one process at a time, checksums against changes."""
