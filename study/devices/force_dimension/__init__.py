"""Driver for devices of Force Dimension through the vendor's shared library, which is located and never shipped.

In the order of opening: `locate_library` and `library` (its functions), `connect` (open, arm the watchdog; `usb`,
`device_models`, `lab`), `handle` (an open device), `rig` (the driver, with compiled input and output in `tick_io` and
their `loop_cells`); `open_rig` builds the driver. Before a hand may hold the device: `watchdog_check` at every opening,
`force_limit_check` and `acceptance`; `findings` for `hapteq doctor`. `linkage` reads the kinematics. Used by
`rigs_by_name` and `opening`. Begin at `open_rig.py`, then `rig.py`.

Source of the functions' signatures: the public header of SDK 3.17.5. Tested on a stub of the library
(`tests/study/devices/force_dimension/dhd_stub.c`), not yet on a device: `docs/hardware.md` lists what remains to be
tested.
"""
