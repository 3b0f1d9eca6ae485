"""Contents of a foreign file: `csv_arrays`, `workbook_arrays`, `json_arrays`, `mat_arrays` and `npz_hdf5_arrays`
(NPZ, NPY, HDF5) behind `read_arrays`; `table_marks` and `table_layout` say where the parts of a table are."""
