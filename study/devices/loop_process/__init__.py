"""Separate process for a real device's loop; only this process opens the device.

`start` begins the process, `serve` is what runs in it: the safety layer as ever, with a thread for each of the `LINES`.
`line` is this side of a pipe, `remote_device` the device port over all of them. Begin at `remote_device.py`.
"""
