"""What a map says, and whether it fits the given files.

`map_toml` (text) -> `import_map` (the value) -> `map_files`, `map_segments` (its parts); `signal_words` reads channel
names, `map_errors` are what an import raises. Begin at `import_map.py`.
"""
