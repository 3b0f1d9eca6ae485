"""Laws without a name: a formula of the motion and the commands, read from text, and evaluated along samples or steps.

Read in this order: `law` (the value), `parse` (what the language holds), `program` and `kernel` (how it is computed),
`evaluate` (along measured samples). `equalizer.effects.discovered_law` makes an effect of it that a simulation plays.
"""
