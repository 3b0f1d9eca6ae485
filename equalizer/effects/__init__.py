"""Physical effects that a device model may lack, such as friction, end stops, sensor lag: one file each, same layout.

`effect` defines the data type, `catalogue` collects all effects, `placing` assigns those of a model file to axes, and
`command_sign` reverses them with a command. Order of the data: residuals of a model -> `starts` (starting values) ->
`simulation` (response with the effects). `discovered_law` and `law_entry` make effects of formulas without a name. Used
by `analysis.diagnosis` and `equalizer.tracking.compensation`. Begin at `effect.py`, then `coulomb_friction.py`.
"""
