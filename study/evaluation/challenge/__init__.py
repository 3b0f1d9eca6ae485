"""The reality of concealed cases: a bench with what a model of it may lack, in its own equations.

`rig` (how large) -> `bench`, `device` (what it really is, `effects` built in, `extras` that every device has) ->
`drive_plan` (what it is driven with) -> `sensor` -> `nominal` (the model a lab would have) -> `draw_case`,
`draw_bank`. `controls`, `injection` (faults put into real recordings) and `second_engine` (MuJoCo) stand beside it.
Begin at `draw_case.py`.
"""
