"""Figures: plain functions from arrays to a matplotlib Figure, grouped as the page is."""
