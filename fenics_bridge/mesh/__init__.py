"""Background meshes and soil bodies: reading, building, naming and distributing them."""
