"""Reproduction of the published figures 1 to 5 on the simulated omega.3; slow steps are cached.

`reproduction_plan` -> `reproduce_recordings` -> `reproduce_playback`, `reproduce_equalized`,
`reproduce_baselines` -> `reproduction_results` -> `write_reproduction`. Begin at `reproduce_paper.py`.
"""
