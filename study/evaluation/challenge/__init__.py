"""Generator of the concealed cases: a test bench whose model lacks some of its physics, in equations of its own.

`rig` (size) -> `bench`, `device` (the true physics, with `effects` built in and `extras` that every device has) ->
`drive_plan` (excitation) -> `sensor` -> `nominal` (the model a laboratory would have) -> `draw_case`, `draw_bank`.
`controls`, `injection` (faults put into real recordings) and `second_engine` (MuJoCo) stand beside it. Begin at
`draw_case.py`.
"""
