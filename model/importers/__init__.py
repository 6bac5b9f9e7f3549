"""Feeders from other programs' files: each importer reads one format, none writes."""
