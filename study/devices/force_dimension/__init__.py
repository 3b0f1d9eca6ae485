"""Driver for devices of Force Dimension through the vendor's own shared library, which is located and never shipped.

Facts about its functions: the public header of SDK 3.17.5. Proved on a stub of it (`tests/study/devices/
force_dimension/dhd_stub.c`), not yet on a device: `docs/hardware.md` says what that leaves open.
"""
