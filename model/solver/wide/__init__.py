"""The ladder for eight scenarios at a time, where nothing loops."""
