"""Site files: what a site is made of, its doubts, laws, meshes, tables and pictures."""
