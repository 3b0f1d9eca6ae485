"""The findings of a diagnosis and their wording.

In this order: `assemble_findings` puts a finished search into `findings`: the effects with their parameters
(`named_effects`), the errors (`error_table`), the examination of the fits after the search (`examine_fits`:
localisation, the curve of each effect, a black box) and the recording to make next (`propose_experiment`). `wording`
puts the findings into sentences; `make_real_answer` makes the plain values of a real recording (`real_answer`). Begin
at `assemble_findings.py`.
"""
