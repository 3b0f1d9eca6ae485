"""Telemetry ring buffer: the readings and forces of each tick of a device's loop, in memory that other programs can
read.

One writer, the loop (`governor.telemetry_row`), any number of readers. The writer never waits for a reader; a reader
that is too slow counts the rows that it lost. The ring is a file in memory (Linux: /dev/shm; elsewhere the folder for
temporary files), made and removed by the program that opened the device, so that no file remains when the loop's
process is killed.

The first row is a header: format, rate, number of rows written so far. Row k of the loop is in row 1 + k mod size, with
its own number k and a checksum: a reader recognises by them a row that is being overwritten.
"""

import contextlib
import mmap
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.governor import cells
from study.errors import StudyError
from study.regular_file import open_regular

RING_ROWS = 16384
"""Rows of a ring: 16 s at 1 kHz, for which a reader may pause and loses nothing. Chosen."""

FORMAT_VERSION = 2.0
"""Version of the row format."""
RING_FILE_PREFIX, RING_FILE_SUFFIX = "hapteq-", ".ring"
"""Beginning and end of a ring's file name."""
ROW_BYTES = 8 * cells.RING_WIDTH
"""Size of a row, of 64-bit floats."""
MIN_ABANDONED_AGE_S = 60.0
"""Least age (s) of a ring without a lock that is removed: another program may be about to lock a younger one. Chosen
by hand."""


class Ring:
    """Writer's side of a ring. path: empty to make one of `rows` rows, which `remove` removes; else the ring of another
    program. The attribute `path` is empty where the ring could not be made (no memory): then the device works without
    it."""

    def __init__(self, path: str = "", rows: int = RING_ROWS) -> None:
        self.path = path
        self._descriptor: int | None = None
        if not path:
            _remove_abandoned_rings()
            with contextlib.suppress(OSError):
                self._make_ring_file(rows)

    def map_rows(self, rate_hz: float) -> FloatArray | None:
        """Map the ring into memory for the loop, (1 + rows, RING_WIDTH), with every page present before the first tick
        needs it, and write the rate into its header. None where there is no ring, or it cannot be mapped."""
        if not self.path:
            return None
        try:
            rows = _map_rows(Path(self.path), mmap.ACCESS_WRITE)
        except (OSError, ValueError):
            return None
        rows[1:, cells.RING_INDEX] = -1.0
        rows[0, cells.RING_RATE_HZ] = rate_hz
        return rows

    def remove(self) -> None:
        """Remove the ring's file; a reader that has mapped it can still read it. Never raises; may be called again."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            with contextlib.suppress(OSError):
                os.close(descriptor)
            with contextlib.suppress(OSError):
                Path(self.path).unlink()
            self.path = ""

    def _make_ring_file(self, row_count: int) -> None:
        """Make, lock and fill the ring's file; without a lock, or memory for all rows, no ring remains. Raises OSError
        where the file cannot be made."""
        # Kept open: as long as it is locked, the ring is in use.
        self._descriptor, self.path = tempfile.mkstemp(RING_FILE_SUFFIX, RING_FILE_PREFIX, _choose_ring_folder())
        empty_rows = np.zeros((1 + row_count, cells.RING_WIDTH))
        empty_rows[0, cells.RING_FORMAT] = FORMAT_VERSION
        try:
            # Written, not reserved: a page that the system cannot give must fail here and not in the loop.
            is_complete = (
                _lock_file(self._descriptor) and Path(self.path).write_bytes(empty_rows.tobytes()) == empty_rows.nbytes
            )
        except OSError:
            is_complete = False
        if not is_complete:
            self.remove()


@dataclass(frozen=True, slots=True, eq=False)
class Telemetry:
    """Readings and forces of successive ticks, oldest first. Each array has a row per tick; vectors are (n, 3)."""

    time_s: FloatArray
    """(n,) time of the tick's reading on the session's monotonic clock; without a time stamp, when the tick was due."""
    tick: FloatArray
    """(n,) number of the tick in its stimulus, from 0; negative while the handle is brought to rest before it."""
    position_m: FloatArray
    velocity_m_per_s: FloatArray
    """Velocity as the damper uses it, low-passed at 50 Hz; NaN in the phases 0 and 3."""
    acceleration_mps2: FloatArray
    commanded_n: FloatArray
    """The stimulus, within its cap and with its fade; 0 in the phases 0 and 3."""
    applied_n: FloatArray
    """Force that was sent to the device: with spring, damper, slew limit and total cap."""
    phase: FloatArray
    """(n,) 0: no force, 1: playing, 2: fade-out of the stimulus, 3: safety fade of the last force."""
    fault: FloatArray
    """(n,) index of `study.devices.device.Fault`; 0 = none."""
    missed: FloatArray
    """(n,) ticks of this stimulus that were missed so far."""

    def __len__(self) -> int:
        return len(self.time_s)


class TelemetryReader:
    """Reader's side of a ring, from the first row that is written after it was made. Raises `StudyError` for a file
    that cannot be read or is no ring."""

    def __init__(self, path: Path) -> None:
        try:
            self._rows = _map_rows(path, mmap.ACCESS_READ)
        except (OSError, ValueError) as error:
            raise StudyError(
                "The device's loop cannot be followed",
                f"{path.name}: {error}.",
                "Begin the sitting anew; its recordings are written all the same.",
            ) from error
        self.rate_hz = float(self._rows[0, cells.RING_RATE_HZ])
        self._next_row = int(self._rows[0, cells.RING_COUNT])
        self.lost = 0
        """Rows that were overwritten before they were read, since the beginning."""

    def read(self) -> Telemetry:
        """Read the rows since the last call. Rows that were overwritten before are counted in `lost`."""
        ring_rows = len(self._rows) - 1
        end_row = int(self._rows[0, cells.RING_COUNT])
        first_row = max(self._next_row, end_row - ring_rows)
        row_numbers = np.arange(first_row, end_row)
        rows = self._rows[1 + row_numbers % ring_rows]  # a copy
        is_intact = _is_consistent(rows) & (rows[:, cells.RING_INDEX] == row_numbers)
        # An inconsistent row was overwritten meanwhile (it is lost), or is being written (the next call reads it).
        unfinished_rows = row_numbers[~is_intact & (row_numbers > int(self._rows[0, cells.RING_COUNT]) - ring_rows)]
        if len(unfinished_rows):
            end_row = int(unfinished_rows[0])
        is_readable = is_intact & (row_numbers < end_row)
        self.lost += end_row - self._next_row - int(np.count_nonzero(is_readable))
        self._next_row = end_row
        return _make_telemetry(rows[is_readable])


def _is_consistent(rows: FloatArray) -> np.ndarray:
    """Whether the checksum of each row is right, (n,): sum of (bits ^ (bits >> RING_FOLD)) RING_FACTORS over the cells,
    modulo 2^64."""
    row_bits = rows.view(np.int64)
    checked_bits = row_bits[:, : cells.RING_CHECK]
    checksums = np.sum((checked_bits ^ (checked_bits >> cells.RING_FOLD)) * cells.RING_FACTORS, axis=1)
    is_consistent: np.ndarray = checksums == row_bits[:, cells.RING_CHECK]
    return is_consistent


def _make_telemetry(rows: FloatArray) -> Telemetry:
    """Convert rows (n, RING_WIDTH) to readings and forces."""

    def select_vector(first_column: int) -> FloatArray:
        """Select three columns (n, 3), from `first_column` on."""
        return rows[:, first_column : first_column + 3]

    return Telemetry(
        time_s=rows[:, cells.RING_TIME_S],
        tick=rows[:, cells.RING_TICK],
        position_m=select_vector(cells.RING_POSITION),
        velocity_m_per_s=select_vector(cells.RING_VELOCITY),
        acceleration_mps2=select_vector(cells.RING_ACCELERATION),
        commanded_n=select_vector(cells.RING_COMMANDED),
        applied_n=select_vector(cells.RING_APPLIED),
        phase=rows[:, cells.RING_PHASE],
        fault=rows[:, cells.RING_FAULT],
        missed=rows[:, cells.RING_MISSED],
    )


def _map_rows(path: Path, access: int) -> FloatArray:
    """Map a ring's file into shared memory, as an array (1 + rows, RING_WIDTH). access: a mode of `mmap`. Raises
    OSError, and ValueError for a file that is no ring of this version."""
    # Only regular files: opening a pipe for reading would wait for its writer.
    with open_regular(path) if access == mmap.ACCESS_READ else path.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), 0, access=access)
    if len(memory) < 2 * ROW_BYTES or len(memory) % ROW_BYTES:
        raise ValueError("it is no telemetry ring")
    rows = np.frombuffer(memory, dtype=np.float64).reshape(-1, cells.RING_WIDTH)
    if rows[0, cells.RING_FORMAT] != FORMAT_VERSION:
        raise ValueError("it is a telemetry ring of another version")
    return rows


def _choose_ring_folder() -> str:
    """Return the folder of the rings: /dev/shm where it exists, else the folder for temporary files."""
    memory_folder = Path("/dev/shm")
    return str(memory_folder) if memory_folder.is_dir() else tempfile.gettempdir()


def _lock_file(descriptor: int) -> bool:
    """Lock the file, and return whether it was locked: False where another program has the lock or locking fails;
    always True on Windows, which has no such locks."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _remove_abandoned_rings() -> None:
    """Remove the rings of programs that were killed: those of this user without a lock, older than
    `MIN_ABANDONED_AGE_S`. Never raises for a ring that cannot be removed. On Windows, where a ring has no lock, they
    remain."""
    if sys.platform == "win32":
        return
    for path in Path(_choose_ring_folder()).glob(f"{RING_FILE_PREFIX}*{RING_FILE_SUFFIX}"):
        with contextlib.suppress(OSError):
            descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
            try:
                has_same_owner = os.fstat(descriptor).st_uid == os.getuid()
                if (
                    has_same_owner
                    and time.time() - os.fstat(descriptor).st_mtime > MIN_ABANDONED_AGE_S
                    and _lock_file(descriptor)
                ):
                    path.unlink()
            finally:
                os.close(descriptor)
