"""The effects that can be concealed, by family: each file draws an effect's parameters and builds it into a device.

Of the catalogue: `actuator`, `friction`, `inertia_and_drag`, `springs`, `hand`, `sensor`, along the signal's path.
`decoys` are outside of it: a right diagnosis leaves them without a name. `concealed_effect`, one folder
up, is what an effect consists of; `draw_case` collects them. Begin at `springs.py`.
"""
