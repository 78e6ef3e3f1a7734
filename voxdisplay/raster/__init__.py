"""Grids, pixel formats, colours and palettes. Knows no packets, curves or displays."""
