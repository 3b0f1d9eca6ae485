"""How the safety layer is compiled, and how its machine code on disk is kept in step with its sources.

numba holds kept code for good as long as the file of that very function is the same, and does not watch the files of
what it calls. It also compares what a function encloses: an entry point that encloses the fingerprint of a folder is
compiled anew whenever any file of the folder changes, and what it calls has no kept code of its own.
"""

import hashlib
from pathlib import Path

from numba import njit

part = njit(forceinline=True, nogil=True, error_model="numpy")
"""A function within the tick, never kept on its own. Division by zero gives inf or NaN, which `confine` knows, and
never an exception halfway through a tick. Inlined, a tick takes half the time that calls take."""


def fingerprint(folder: Path, *beyond: Path) -> int:
    """Checksum (32 bits) of all Python sources in the folder, and of files outside it whose constants are compiled
    in."""
    digest = hashlib.sha256()
    for source in (*sorted(folder.glob("*.py")), *beyond):
        digest.update(source.read_bytes())
    return int.from_bytes(digest.digest()[:4], "big")
