"""The published figures 1 to 5 on the simulated omega.3; what takes long is kept and used again.

`reproduction_plan` -> `reproduce_recordings` -> `reproduce_models` -> `reproduce_playback`, `reproduce_equalized`,
`reproduce_baselines` -> `reproduction_results` -> `write_reproduction`. Begin at `reproduce_paper.py`.
"""
