"""Voxelisers of geometries: one module for each, from arrays and a box to voxels."""
