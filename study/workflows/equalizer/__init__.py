"""From recordings to an identified model, and from a trajectory to forces.

`recordings_without_effects` (named effects removed) -> `identify_model` -> `report_identification`;
`playback_models` -> `equalize_trajectory` -> `repeat_trajectory` (play, measure, correct). Each has its `*_summary`
for screen and program. Begin at `identify_model.py`, then `equalize_trajectory.py`.
"""
