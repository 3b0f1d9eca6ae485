"""From recordings to an identified model, and from a reference trajectory to the forces that play it.

Identification: `recordings_without_effects` (known effects removed) and `direction_limit` (upper end of the band, from
a study) -> `identify_model` -> `identified_summary` -> `report_identification`. Playback: `playback_models` (read,
combine) -> `equalize_trajectory` (compute; `equalized_summary`) or `repeat_trajectory` (play, measure, correct:
`repeat_playback`, `repeat_results`); `play_contact` for a transient at a contact. `play_forces` plays on the device
(`spring_to_compensate`); `controller` exports C sources. Used by `study.cli`. Begin at `identify_model.py`, then
`equalize_trajectory.py`.
"""
