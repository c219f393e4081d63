"""What lies on the disk: whole files or none, one process at a time, and a checksum that tells of changes."""
