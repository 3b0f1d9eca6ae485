"""Import of recordings of other programs, by a map (TOML) that states the channel, unit and clock of each array.

`arrays` (files -> arrays by name) and `map_format` (map text -> ImportMap) -> `expressions` (arithmetic over arrays) ->
`uniform_stamps`, `time_base`, `alignment` (clocks) -> `part_signals` (one time grid) -> `build_recording` (SI units).
`map_remarks` reports what a map and a file contradict in. `map_library` and `model_library` find maps and models,
shipped ones in `maps/` and `models/`. Without a map, `header_map` makes one from names and units, or `map_skeleton` an
incomplete one, with `array_groups` (several runs in one file), `surplus_arrays` (arrays to omit) and `imposed_roles`
(command or response). Used by `study.workflows.recording` and `study.evaluation.real`. Begin at `build_recording.py`.
"""
