"""Curves of missing physics against the variables that it may depend on, with the fitted laws.

`signature_curves` selects the variable of a named effect and computes its curve, `law_curves` that of a discovered law;
both average over the bins of `signature_bins`. `state_maps` gives the missing force over position, velocity, command
and time, also where no effect is named. Used by `result.examine_fits` and `diagnose`. Begin at `signature_curves.py`.
"""
