"""Safe reading and writing for all formats: regular files only, limited in size, written atomically.

`declared_size`, `strict_json` (reading) and `atomic_write`, `new_folder`, `privacy` (writing) -> `text_file` (also
TOML), `json_document`, `hdf5_file`, `csv_rows`, `wav_file`; `file_errors` are the errors of all of them. Begin at
`json_document.py`.
"""
