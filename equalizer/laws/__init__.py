"""Laws as formulas of motion and commands: parsed from text, and evaluated along samples or simulation steps.

Order of the data: text -> `parse` (grammar) -> `tree` (expression tree, and its text) -> `law` (the formula with the
values of its parameters) -> `program` (postfix code) -> `kernel` (stack machine) -> `evaluate` (values along samples).
`units`: dimensional analysis. Used by `equalizer.effects` (`discovered_law` makes a law an effect of a simulation) and
`analysis.diagnosis.discovery`. Begin at `law.py`.
"""
