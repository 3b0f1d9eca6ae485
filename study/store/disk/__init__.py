"""Safe reading and writing, whatever the format: regular files only, whole or not at all, of a stated size.

`regular_file`, `declared_size`, `strict_json` (reading) and `atomic_write`, `new_folder`, `privacy` (writing) ->
`text_file`, `toml_text`, `json_document`, `hdf5_file`, `csv_rows`, `wav_file`; `file_errors` are what all of them
raise. Begin at `json_document.py`.
"""
