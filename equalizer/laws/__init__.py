"""Laws as formulas of motion and commands: parsed from text, and evaluated along samples or simulation steps.

Read in this order: `law` (the value), `parse` (what the language holds), `program` and `kernel` (how it is computed),
`evaluate` (along measured samples). `equalizer.effects.discovered_law` makes an effect of it that a simulation plays.
"""
