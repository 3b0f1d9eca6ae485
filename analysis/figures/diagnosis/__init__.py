"""Figures of one diagnosis: findings in, pictures out.

Begin with `diagnosis_pictures`, which hands each part of the findings to its file, in the order of the report:
`mismatch_map` (where the model is off), `state_maps` (the missing force over the states of motion), `signature` (each
named effect), `rivals` (what else was tried), `held_out` (errors on data that nothing was fitted to), `remainder` (the
spectrum of what is left). `stage_style` gives the three predictions their colour and name in all of them.
`real_held_out` draws the one figure of each recording in the report on real recordings.
"""
