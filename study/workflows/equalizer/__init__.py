"""From recordings to an identified model, and from a wanted trajectory to the forces that play it.

Identification: `recordings_without_effects` (known effects removed) -> `identify_model` -> `report_identification`.
Playback: `playback_models` (read, combine) -> `equalize_trajectory` (compute) or `repeat_trajectory` (play, measure,
correct); `play_contact` for a transient at a contact, both with `play_forces`; `controller` for C sources. Begin at
`identify_model.py`, then `equalize_trajectory.py`.
"""
