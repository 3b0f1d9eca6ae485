"""Effects that can be concealed, by family: each file draws the parameters of its effects and builds them into a
device.

In the catalogue, along the path of the signal: `actuator`; `friction`, `inertia_and_drag`, `springs`, `hand`; `sensor`.
Outside the catalogue: `decoys`, which a correct diagnosis does not name. `challenge.concealed_effect` defines an
effect. Used by `challenge.draw_case`, which collects them. Begin at `springs.py`.
"""
