"""What changed at a device since an earlier recording of the same excitation: friction, gain, response, noise.

`measure_device` makes numbers of one recording; `compare_devices` sets two of them side by side, with limits.
`probe_lines` and `probe_drift` do that for short probes within a session, with a hand on the handle.
"""
