"""The people's door: one file per verb, and the command line."""
