"""A database written for other programs: HDF5 and MAT-files."""
