"""Compilation of the control tick with numba, and invalidation of cached machine code.

numba reuses cached code of a function while the file of that function is unchanged; it ignores changes in the files of
the functions that it calls. It also compares the values that a closure captures. Entry points therefore capture the
fingerprint of a folder, so that they are compiled again after a change of any Python source in it.
"""

import hashlib
from pathlib import Path

from numba import njit

njit_inline = njit(forceinline=True, nogil=True, error_model="numpy")
"""Decorator that compiles a function into its callers within a control tick; its machine code is not cached itself.
Division by zero gives inf or NaN, which `confine` handles, instead of an exception within a tick. Inlining halves the
duration of a tick."""


def compute_fingerprint(folder: Path, *further_sources: Path) -> int:
    """Compute the checksum (first 32 bits of SHA-256) of all Python sources in the folder itself, and of further files
    whose code or constants are compiled into an entry point, whose closure captures the result."""
    digest = hashlib.sha256()
    for source in (*sorted(folder.glob("*.py")), *further_sources):
        digest.update(source.read_bytes())
    return int.from_bytes(digest.digest()[:4], "big")
