"""Import foreign recordings through a map that says which array is what.

`arrays` (files -> arrays by name) and `map_format` (map text -> ImportMap) -> `expressions` (definitions over arrays)
-> `uniform_stamps`, `time_base`, `alignment` (clocks) -> `part_signals` -> `build_recording`. `map_library` and
`model_library` are what is shipped (`maps/`, `models/`); `header_map` and `map_skeleton` make a map where there is
none. Begin at `build_recording.py`.
"""
