"""The force balance along a measured motion: linear regression of the force on many laws at once, before any model.

`motion` makes positions, velocities and accelerations of a recording, within the band that its noise allows; `laws`
lists the terms that physics may add to mass, damping and stiffness; `regression` filters them alike and holds their
products block by block; `structures` searches sums of one to three laws, and takes the one with the fewest parameters
that fits about as well as the best; `judge_laws` decides on held-out data which laws are named, which are candidates,
and which the data cannot distinguish. Begin at `judge_laws.py`.
"""
