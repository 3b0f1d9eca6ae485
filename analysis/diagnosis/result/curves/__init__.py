"""What is missing, drawn over what it may depend on, with the laws that were fitted.

`signature_curves` gives the curve of a named effect, `law_curves` that of a discovered law, over bins of
`signature_bins`; `state_maps` gives the missing force over position, velocity, command and time, where nothing is named
too.
"""
