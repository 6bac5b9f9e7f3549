"""Data of the user's own: connections, reclosers and measured loads joined to a feeder."""
