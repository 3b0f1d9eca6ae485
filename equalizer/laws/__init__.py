"""Laws as formulas of motion and commands: parsed from text, and evaluated along samples or simulation steps.

Order of the data: text -> `parse` (grammar) -> `tree` (expression tree, and its text) -> `law` (the formula with the
values of its parameters) -> `program` (postfix code) -> `kernel` (stack machine) -> `evaluate` (values along samples).
`units`: dimensional analysis. `equalizer.effects.discovered_law` makes a law an effect of a simulation. Begin at
`law.py`.
"""
