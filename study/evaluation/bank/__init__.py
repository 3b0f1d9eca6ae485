"""A bank of a blind test: concealed faults are sealed, diagnosed by separate processes without access to the truth,
revealed and scored.

`prove` runs: `seal_cases` (with `begun_cases`, `proof_folder`, `proof_seals`) -> `ask_engine` (starts `answer_cases` in
separate processes), `follow_up`, `run_controls` -> `sealed_bank` (checks seals, pairs answers with labels) ->
`proof_summary`, `write_proof`. `laws`: the same for concealed laws outside the catalogue of effects. Used by
`study.cli.prove` and `study.evaluation.real`. Begin at `prove.py`.
"""
