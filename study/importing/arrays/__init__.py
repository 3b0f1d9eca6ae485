"""Arrays of a foreign file by name.

`read_arrays` calls the reader of the format: `csv_arrays`, `workbook_arrays`, `json_arrays`, `mat_arrays` or
`npz_hdf5_arrays` (NPZ, NPY, HDF5). Tables: `table_text` (encoding) -> `table_marks`, `table_layout` (delimiter, header,
rows) -> `table_cells`, `time_stamps` (values). Used by `study.importing.build_recording` and
`study.importing.map_library`. Begin at `read_arrays.py`.
"""
