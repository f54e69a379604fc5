"""Gear meshes: geometry, and stiffness over the rotation."""
