"""Format of an import map, and the assignment of files to it.

`map_toml` (text) -> `import_map` (the value) -> `map_files`, `map_segments` (its parts); `signal_words` interprets
channel names, `map_errors` are the errors of an import. Used by all of `study.importing`. Begin at `import_map.py`.
"""
