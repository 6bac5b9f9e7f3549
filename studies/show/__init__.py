"""Showing a study: plots, settings sheet, report."""
