"""Changes of a device since an earlier recording of the same excitation: friction, gain, response, noise.

`measure_device` computes numbers from one recording; `compare_devices` compares two of them with limits. `probe_lines`
and `probe_drift` do that for short probes within a session, with a hand on the handle.
"""
