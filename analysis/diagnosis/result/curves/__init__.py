"""Curves of missing physics against the variables that it may depend on, with the fitted laws.

`signature_curves` gives the curve of a named effect, `law_curves` that of a discovered law, over bins of
`signature_bins`; `state_maps` gives the missing force over position, velocity, command and time, also where nothing is
named.
"""
