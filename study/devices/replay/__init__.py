"""A device that replays a recording, for demonstrations and tests: the handle moves as recorded, independent of the
force.

`replay_rig` is the driver, made by `rigs_by_name` for the device name `replay:FILE`.
"""
