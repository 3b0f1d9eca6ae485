"""Limit of the size that a file declares for its contents, checked before memory is allocated.

A small damaged or malicious file can declare gigabytes. The limit is `MAX_EXPANSION` times the bytes on the disk, but
at least `MIN_LIMIT_BYTES` and at most `MAX_LIMIT_BYTES`.
"""

MIN_LIMIT_BYTES = 2**27
"""Least limit (128 MiB). Chosen: 1.8 million samples of nine channels in float64."""
MAX_EXPANSION = 100
"""Limit of the ratio of declared bytes to bytes on the disk. Chosen: compressed measurements stay below it."""
MAX_LIMIT_BYTES = 2**32
"""Greatest limit (4 GiB). Chosen: more than an hour of nine channels at 10 kHz in float64 (2.6 GB)."""


class DeclaredSizeError(ValueError):
    """A file declares more bytes than its limit. The message is a clause without a full stop."""


class SizeLimit:
    """Sum and limit of the declared bytes of one file. file_bytes: its size on the disk."""

    def __init__(self, file_bytes: int) -> None:
        self.limit_bytes = min(MAX_LIMIT_BYTES, max(MIN_LIMIT_BYTES, MAX_EXPANSION * file_bytes))
        self._declared_bytes = 0

    def add_size(self, array_name: str, size_bytes: int) -> None:
        """Add the declared size of an array; array_name: for messages. Raises DeclaredSizeError where the sum exceeds
        the limit."""
        self._declared_bytes += size_bytes
        if self._declared_bytes > self.limit_bytes:
            raise DeclaredSizeError(
                f"{array_name} declares {size_bytes} bytes, and with all before it more than the {self.limit_bytes} "
                "that are read of a file of this size; save it without compression, or in parts"
            )
