"""What a foreign file holds: `csv_arrays`, `mat_arrays` and `stored_arrays` (NPZ, NPY, HDF5) behind `arrays`."""
