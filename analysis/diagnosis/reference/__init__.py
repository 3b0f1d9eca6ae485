"""Diagnosis with reference recordings of the same device without the fault (`--clean`).

`model_free_faults` and `compare_with_reference` name what sets the recordings apart without a model of the mismatch;
`learn_model_error` learns how far a re-tuned model is off on a device in order, and `search_beside_reference`
searches for effects that exceed it. Begin at `search_beside_reference.py`.
"""
