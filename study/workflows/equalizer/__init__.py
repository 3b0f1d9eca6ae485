"""From recordings to a model file, and from a trajectory to forces.

`freed_recordings` (named effects taken off) -> `identify_model` -> `report_identification`;
`models_for_playing` -> `equalize_trajectory` -> `repeat_trajectory` (played, measured, corrected). Each has its
`*_summary` for screen and program. Begin at `identify_model.py`, then `equalize_trajectory.py`.
"""
