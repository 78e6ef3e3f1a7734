"""Files of meshes, volumes and voxel models: readers and writers. Must not know displays."""
