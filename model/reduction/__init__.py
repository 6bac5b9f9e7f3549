"""Fewer buses: laterals and low-voltage networks folded, a named approximation."""
