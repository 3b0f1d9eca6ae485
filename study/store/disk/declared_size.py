"""Limit of the size that a file declares for its contents, checked before memory is allocated.

A small damaged or malicious file can declare gigabytes. The limit is FACTOR times the bytes on the disk, but at least
PLAIN_BYTES and at most MOST_BYTES. For comparison: an hour of nine channels at 10 kHz in float64 has 2.6 GB.
"""

PLAIN_BYTES = 2**27
"""Declared bytes that every file may have (128 MiB)."""
FACTOR = 100
"""Largest accepted ratio of declared bytes to bytes on the disk; compressed measurements stay below it."""
MOST_BYTES = 2**32
"""Largest number of declared bytes of any file (4 GiB)."""


class DeclaredSizeError(ValueError):
    """A file declares more than is allowed. The message is a sentence fragment for `UnusableFileError` and
    `ImportRefusedError`."""


class SizeLimit:
    """Budget of declared bytes for one file. file_bytes: its size on the disk."""

    def __init__(self, file_bytes: int) -> None:
        self.most_bytes = min(MOST_BYTES, max(PLAIN_BYTES, FACTOR * file_bytes))
        self._declared = 0

    def add_size(self, array_name: str, size: int) -> None:
        """Add a declared size (bytes); array_name: for messages. Raises DeclaredSizeError where the sum exceeds the
        limit."""
        self._declared += size
        if self._declared > self.most_bytes:
            raise DeclaredSizeError(
                f"{array_name} declares {size} bytes, and with all before it more than the {self.most_bytes} that are "
                "read of a file of this size; save it without compression, or in parts"
            )
