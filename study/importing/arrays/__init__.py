"""Contents of a foreign file: `csv_arrays`, `mat_arrays` and `stored_arrays` (NPZ, NPY, HDF5) behind `arrays`."""
