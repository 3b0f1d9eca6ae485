"""A packet of the accelerometer's firmware, 16 bytes, the low byte first; `docs/firmware/packet.h` makes the same.

 0  2  sync, A5 5A
 2  2  sequence number, modulo 2^16
 4  4  time stamp of the sample, µs by the microcontroller's clock, modulo 2^32
 8  6  raw values of x, y, z
14  2  CRC-16/CCITT-FALSE (polynomial 1021, from FFFF) of bytes 2 to 13
"""

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]

SIZE = 16
SYNC = bytes((0xA5, 0x5A))
CHECKED = slice(2, 14)
POLYNOMIAL, START = 0x1021, 0xFFFF

LAYOUT = np.dtype(
    [("sync", "<u2"), ("sequence", "<u2"), ("time_us", "<u4"), ("raw", "<u2", (3,)), ("crc", "<u2")]
)  # fmt: skip


def crc_of(rows: Bytes) -> npt.NDArray[np.uint16]:
    """Of each row of bytes, shape (n, k): shape (n,)."""
    crc = np.full(len(rows), START, dtype=np.uint16)
    for column in rows.T:
        crc = (crc << 8) ^ _TABLE[(crc >> 8) ^ column]
    return crc


def packed(sequence: npt.ArrayLike, time_us: npt.ArrayLike, raw: npt.ArrayLike) -> bytes:
    """Packets as the firmware sends them; sequence (n,), time_us (n,) and raw (n, 3), taken modulo their range."""
    numbers = np.atleast_1d(np.asarray(sequence, dtype=np.int64))
    packets = np.zeros(len(numbers), dtype=LAYOUT)
    packets["sync"] = int.from_bytes(SYNC, "little")
    packets["sequence"] = numbers & 0xFFFF
    packets["time_us"] = np.asarray(time_us, dtype=np.int64) & 0xFFFFFFFF
    packets["raw"] = raw
    packets["crc"] = crc_of(packets.view(np.uint8).reshape(-1, SIZE)[:, CHECKED])
    return packets.tobytes()


def _table() -> npt.NDArray[np.uint16]:
    table = np.arange(256, dtype=np.uint32) << 8
    for _ in range(8):
        table = np.where(table & 0x8000, (table << 1) ^ POLYNOMIAL, table << 1) & 0xFFFF
    return table.astype(np.uint16)


_TABLE = _table()
