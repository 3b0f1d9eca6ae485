"""Diagnosis with reference recordings of the same device without the fault (`--clean`).

`model_free_faults` and `compare_with_reference` name faults without a model of the mismatch; `learn_model_error`
estimates the error of a re-tuned model on the reference recordings, and `search_with_reference` searches for effects
that exceed it. Begin at `search_with_reference.py`.
"""
