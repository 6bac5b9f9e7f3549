"""Choosing and certifying settings and places: arrays in, decisions out."""
