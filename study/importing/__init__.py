"""Import of recordings of other programs, by a map (TOML) that states the channel, unit and clock of each array.

`arrays` (files -> arrays by name) and `map_format` (map text -> ImportMap) -> `expressions` (arithmetic over arrays) ->
`uniform_stamps`, `time_base`, `alignment` (clocks) -> `part_signals` (one time grid) -> `build_recording` (SI units).
`map_library` and `model_library` find maps and models, shipped ones in `maps/` and `models/`. For a file without a map,
`header_map` makes a map from names and units, and `map_skeleton` an incomplete one; `surplus_arrays` and
`imposed_roles` decide for both. Begin at `build_recording.py`.
"""
