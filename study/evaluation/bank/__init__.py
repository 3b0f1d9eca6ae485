"""A bank of concealed faults: sealed, answered by processes that know nothing, revealed, scored.

`seal_cases` (`write_cases`, `proof_folder`, `proof_seals`) -> `ask_engine` (starts `answer_cases` in processes of their
own), `follow_up`, `run_controls` -> `sealed_bank` (answers, seals and labels, of laws too) -> `proof_summary`,
`write_proof`. Begin at `prove.py`.
"""
