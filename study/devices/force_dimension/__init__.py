"""Driver for devices of Force Dimension through the vendor's own shared library, which is located and never shipped.

`locate`, `library` (its functions) -> `connect` (open, calibrate, arm the watchdog; `usb`, `models`, `lab`) -> `handle`
(an open device) -> `rig` (the driver, with the compiled halves of `tick_io` and their `loop_cells`), built by `rigs`.
Before a hand may hold it: `watchdog_check` at every opening, `force_limit_check` and `acceptance` once, `findings` for
`hapteq doctor`. `linkage` reads the calibration. Begin at `rigs.py`, then `rig.py`.

Facts about its functions: the public header of SDK 3.17.5. Proved on a stub of it (`tests/study/devices/
force_dimension/dhd_stub.c`), not yet on a device: `docs/hardware.md` says what that leaves open.
"""
