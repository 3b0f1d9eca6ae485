"""Diagnosis with reference recordings of the same device without the fault (`--clean`).

`compare_with_reference` names faults by comparison of the recordings (`contrast`), also those of `model_free_faults`.
Where it names none: `learn_model_error` (error of a re-tuned model on the reference recordings) ->
`search_with_reference` (search for effects that exceed it). Used by `diagnose` and `search_by_simulation`. Begin at
`compare_with_reference.py`.
"""
