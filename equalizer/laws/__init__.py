"""Laws as formulas of motion and commands: parsed from text, and evaluated along samples or simulation steps.

Read in this order: `law` (the value), `parse` (the language), `program` and `kernel` (how it is computed), `evaluate`
(along measured samples). `equalizer.effects.discovered_law` turns it into an effect of a simulation.
"""
