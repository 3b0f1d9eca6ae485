"""Limit of the declared size of a file's contents, checked before memory is allocated.

A small file can declare gigabytes. Contents may have PLAIN_BYTES in any case, beyond that FACTOR times the bytes on
disk, and never more than MOST_BYTES: an hour of nine channels at 10 kHz is 2.6 GB.
"""

PLAIN_BYTES = 2**27
"""Declared bytes that any file may have."""
FACTOR = 100
"""Declared bytes per byte on disk: more than that is no compressed data."""
MOST_BYTES = 2**32
"""Declared bytes that no file may have more of."""


class DeclaredSizeError(ValueError):
    """More is declared than allowed. A sentence fragment for `UnusableFileError` and `ImportRefusedError`."""


class SizeLimit:
    """Budget of one file. file_bytes: on disk."""

    def __init__(self, file_bytes: int) -> None:
        self.most_bytes = min(MOST_BYTES, max(PLAIN_BYTES, FACTOR * file_bytes))
        self._declared = 0

    def take(self, what: str, size: int) -> None:
        """Count a declared size. Raises DeclaredSizeError beyond the limit."""
        self._declared += size
        if self._declared > self.most_bytes:
            raise DeclaredSizeError(
                f"{what} is said to hold {size} bytes, and with all before it more than the {self.most_bytes} that are "
                "read of a file of this size; save it without compression, or in parts"
            )
