"""Safe reading and writing for all file formats: regular files only, limited in size, written atomically.

Basic checks and operations: `declared_size`, `strict_json`, `hdf5_contents`, `hdf5_attributes` (reading);
`atomic_write`, `new_folder`, `file_lock`, `privacy`, `real_folder`, `folder_contents` (writing, copying and erasing).
On these build the general formats: `text_file` (also TOML), `json_document`, `hdf5_file`, `csv_rows`, `wav_file`.
`provenance` states the origin of a result, `layout` describes entries of a format, `file_errors` holds the errors of
all modules. Used by `study.store.formats`, `study.store.sessions` and `study.workflows`. Begin at `json_document.py`.
"""
