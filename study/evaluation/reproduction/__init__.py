"""Reproduction of the figures 1 to 5 of Wilson, Chan, Salisbury and Niemeyer on the simulated omega.3; slow steps are
cached.

`reproduce_paper` runs: `reproduction_plan` (settings, folders) -> `reproduce_recordings` (cached recordings) ->
`reproduce_playback`, `reproduce_equalized` (figure 5), `reproduce_baselines` (simpler methods) ->
`reproduction_results` -> `write_reproduction`. Used by `study.cli.reproduce` (`hapteq reproduce`). Begin at
`reproduce_paper.py`.
"""
