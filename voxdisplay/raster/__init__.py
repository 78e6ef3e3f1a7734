"""Grids, pixel formats, colours and palettes. Must not know packets, curves or displays."""
