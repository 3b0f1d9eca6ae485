"""Separate process for a real device's loop; only this process opens the device.

Its purpose: no other work of the program delays a tick, and the force fades when the program ends for any reason.
`remote_device` is the device port; it sends each call through a pipe (`call_pipe`) to the process. `start` starts the
process; `serve` is its main program: the safety layer with a thread for each pipe. Used by `opening`. Begin at
`remote_device.py`.
"""
