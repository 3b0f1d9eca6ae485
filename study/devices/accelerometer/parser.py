"""From bytes as they come, torn, lost or garbled, to samples: every packet whose check sum is right, in order.

A packet is looked for at every byte, so a garbled one hides none of its neighbours. Where two candidates overlap (a
check sum is right by chance once in 65 536 times), the one whose number follows its neighbour's is taken.

A packet is 16 bytes, the low byte first (`docs/firmware/packet.h` makes the same): offset and length of

 0  2  sync, A5 5A
 2  2  sequence number, modulo 2^16
 4  4  time stamp of the sample, µs by the microcontroller's clock, modulo 2^32
 8  6  raw values of x, y, z
14  2  CRC-16/CCITT-FALSE (polynomial 1021, from FFFF) of bytes 2 to 13
"""

from dataclasses import dataclass

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
    """Checksum of each row of bytes, shape (n, k): shape (n,)."""
    crc = np.full(len(rows), START, dtype=np.uint16)
    for column in rows.T:
        crc = (crc << 8) ^ _TABLE[(crc >> 8) ^ column]
    return crc


def encode_packets(sequence: npt.ArrayLike, time_us: npt.ArrayLike, raw: npt.ArrayLike) -> bytes:
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


Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    sequence: npt.NDArray[np.int64]
    """(n,), counted on where the 16 bits of a packet begin anew."""
    time_us: npt.NDArray[np.int64]
    """(n,), counted on likewise."""
    raw: npt.NDArray[np.uint16]
    """(n, 3)."""

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True, slots=True)
class Counts:
    """Samples since the beginning."""

    packets: int = 0
    lost: int = 0
    """Lost packets, from the gaps in the sequence numbers."""
    spoiled_bytes: int = 0
    """Bytes that belonged to no complete packet."""
    restarts: int = 0
    """Number of restarts of the microcontroller."""


class PacketParser:
    def __init__(self) -> None:
        self._rest: Bytes = np.zeros(0, dtype=np.uint8)
        self._last: tuple[int, int] | None = None
        self.counts = Counts()

    def feed(self, data: bytes) -> Samples:
        """The samples that became whole with these bytes."""
        stream = np.concatenate((self._rest, np.frombuffer(data, dtype=np.uint8)))
        starts = _whole_packets(stream)
        starts = starts[_without_overlaps(starts, _packets_at(stream, starts))]
        used = int(starts[-1]) + SIZE if len(starts) else 0
        # What may still be the beginning of a packet waits for its end.
        keep_from = max(used, len(stream) - (SIZE - 1))
        self._rest = stream[keep_from:].copy()
        packets = _packets_at(stream, starts)
        spoiled = keep_from - SIZE * len(starts)
        return self._unwrap_counters(packets, spoiled)

    def _unwrap_counters(self, packets: npt.NDArray[np.void], spoiled: int) -> Samples:
        sequence = packets["sequence"].astype(np.int64)
        time_us = packets["time_us"].astype(np.int64)
        before = self._last if self._last is not None or not len(packets) else (int(sequence[0]) - 1, int(time_us[0]))
        if before is None:
            self.counts = Counts(spoiled_bytes=self.counts.spoiled_bytes + spoiled)
            return Samples(sequence, time_us, packets["raw"])
        steps = np.diff(sequence, prepend=before[0]) % 2**16
        forward = (steps > 0) & (steps < 2**15)
        # Backwards: the firmware began anew. What was lost meanwhile is not known; time and number go on by a step.
        steps = np.where(forward, steps, 1)
        times = np.where(forward, np.diff(time_us, prepend=before[1]) % 2**32, 1)
        sequence, time_us = before[0] + np.cumsum(steps), before[1] + np.cumsum(times)
        if len(packets):
            self._last = int(sequence[-1]), int(time_us[-1])
        was = self.counts
        self.counts = Counts(
            packets=was.packets + len(packets),
            lost=was.lost + int((steps - 1).sum()),
            spoiled_bytes=was.spoiled_bytes + spoiled,
            restarts=was.restarts + int((~forward).sum()),
        )
        return Samples(sequence, time_us, packets["raw"])


def _whole_packets(stream: Bytes) -> Indices:
    """Positions at which packets with a correct checksum begin."""
    last = len(stream) - SIZE + 1
    if last <= 0:
        return np.zeros(0, dtype=np.intp)
    starts: Indices = np.flatnonzero((stream[:last] == SYNC[0]) & (stream[1 : last + 1] == SYNC[1]))
    packets = _packets_at(stream, starts)
    checked = packets.view(np.uint8).reshape(-1, SIZE)[:, CHECKED]
    right: Indices = starts[crc_of(checked) == packets["crc"]]
    return right


def _packets_at(stream: Bytes, starts: Indices) -> npt.NDArray[np.void]:
    packets: npt.NDArray[np.void] = stream[starts[:, None] + np.arange(SIZE)].reshape(-1).view(LAYOUT)
    return packets


def _without_overlaps(starts: Indices, packets: npt.NDArray[np.void]) -> npt.NDArray[np.bool_]:
    """Mask of the candidates to keep, (n,)."""
    kept = np.ones(len(starts), dtype=bool)
    if (np.diff(starts) >= SIZE).all():
        return kept
    sequence = dict(zip(starts.tolist(), packets["sequence"].tolist(), strict=True))
    last = 0
    for k in range(1, len(starts)):
        if starts[k] - starts[last] < SIZE:
            better = _neighbours(int(starts[k]), sequence) > _neighbours(int(starts[last]), sequence)
            kept[last if better else k] = False
            last = k if better else last
        else:
            last = k
    return kept


def _neighbours(start: int, sequence: dict[int, int]) -> int:
    """How many packets right before and right after it have the number before and after its own."""
    own = sequence[start]
    before, after = sequence.get(start - SIZE), sequence.get(start + SIZE)
    return (before == (own - 1) % 2**16) + (after == (own + 1) % 2**16)
