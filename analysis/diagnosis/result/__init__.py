"""The findings of a diagnosis and their wording.

In this order: `assemble_findings` puts a finished search into `findings`: the effects with their numbers
(`named_effects`), the errors (`error_table`), what is looked at once the search is done (`looks`: where it sits, the
curves of each effect, a black box) and the recording to make next (`propose_experiment`). `wording` says it in
sentences; `answer_of_findings` makes the plain values of a real recording (`real_answer`).
"""
