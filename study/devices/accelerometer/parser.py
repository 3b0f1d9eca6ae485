"""Parses a byte stream, which may be torn, incomplete or garbled, to samples: every packet whose checksum is right, in
order.

A packet is looked for at every byte, so a garbled one hides none of its neighbours. A check sum is right by chance once
in 65 536 times; so a packet counts at once where number and time are those that come next at the board's rate, and
otherwise, as after a stall or where the microcontroller began anew, when the next two packets follow it.

A packet is 16 bytes, the low byte first (`docs/firmware/packet.h` makes the same): offset and length of

 0  2  sync, A5 5A
 2  2  sequence number, modulo 2^16
 4  4  time stamp of the sample, µs by the microcontroller's clock, modulo 2^32
 8  6  raw values of x, y, z
14  2  CRC-16/CCITT-FALSE (polynomial 1021, from FFFF) of bytes 2 to 13
"""

import math
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from study.devices.accelerometer.samples import Counts, Samples

Bytes = npt.NDArray[np.uint8]

SIZE = 16
"""Bytes of a packet."""
SYNC = bytes((0xA5, 0x5A))
"""First two bytes of a packet."""
CHECKED = slice(2, 14)
"""Bytes of a packet that its checksum covers."""
POLYNOMIAL, START = 0x1021, 0xFFFF
"""CRC-16-CCITT: generator polynomial and initial value."""

LAYOUT = np.dtype(
    [("sync", "<u2"), ("sequence", "<u2"), ("time_us", "<u4"), ("raw", "<u2", (3,)), ("crc", "<u2")]
)  # fmt: skip
"""Fields of a packet, as in the table above."""


def crc_of(rows: Bytes) -> npt.NDArray[np.uint16]:
    """Checksum of each row of bytes, shape (n, k): shape (n,)."""
    crc = np.full(len(rows), START, dtype=np.uint16)
    for column in rows.T:
        crc = (crc << 8) ^ _TABLE[(crc >> 8) ^ column]
    return crc


def _table() -> npt.NDArray[np.uint16]:
    table = np.arange(256, dtype=np.uint32) << 8
    for _ in range(8):
        table = np.where(table & 0x8000, (table << 1) ^ POLYNOMIAL, table << 1) & 0xFFFF
    return table.astype(np.uint16)


_TABLE = _table()
"""(256,): CRC of each value of a byte, for a step of eight bits."""


LONGEST_SILENCE_US = 10_000_000
"""Between two packets of one clock. After a longer silence the host's clock is fitted anew, as after a restart."""

SHORTEST_PERIOD_US = 50
"""No board sends more often: what looks like many lost packets in too short a time is another clock."""

NEXT_US, JITTER_SHARE, PERIOD_SHARE = 1_000_000, 0.25, 0.01
"""A packet counts at once that comes within this time of the last, by the board's clock, at the time that its number
tells: within a share of a period, and of all the time since the last."""

PERIOD_GAIN = 0.1
"""Weight of a new period in the mean of the periods."""

CONFIRMED_BY = 2
"""Packets that must follow one another to the next before a packet counts that did not come next: two false ones in a
row may, three never do."""

MOST_DOUBTFUL = 8
"""Packets in a row that neither come next nor follow each other: more than chance ever makes."""

Indices = npt.NDArray[np.intp]
Packets = npt.NDArray[np.void]
"""Packets as an array of `LAYOUT`."""


class _Found(NamedTuple):
    """A packet whose checksum is right."""

    packet: Packets
    """(1,)."""
    at: int
    """Its first byte, of all that were received."""


class PacketParser:
    """Parser of a board's byte stream: `feed` takes the bytes as they come, and returns the samples of whole packets.
    Packets with a wrong checksum are skipped and counted."""

    def __init__(self) -> None:
        self._rest: Bytes = np.zeros(0, dtype=np.uint8)
        self._last: Packets | None = None
        """The newest packet that counts, shape (1,)."""
        self._doubtful: list[_Found] = []
        """Those after it that do not come next: the next ones must confirm them."""
        self._period_us = math.nan
        """Mean time from number to number, by the board's clock."""
        self._sequence, self._time_us = 0, 0
        """Number and time of the newest packet, unwrapped."""
        self._received = self._used = self._shared = 0
        """Bytes so far; those up to the end of the newest packet that counts; those that belong to two of them."""
        self.counts = Counts()

    def feed(self, data: bytes) -> Samples:
        """The samples that became whole with these bytes."""
        stream = np.concatenate((self._rest, np.frombuffer(data, dtype=np.uint8)))
        self._received += len(data)
        starts, last = _whole_packets(stream), self._last
        packets, starts = _packets_at(stream, starts), starts + (self._received - len(stream))
        if last is not None and self._in_order(last, starts, packets):
            anew = np.zeros(len(packets), dtype=np.int64)
        else:
            packets, anew = self._choose(starts, packets)
        self._last = packets[-1:].copy() if len(packets) else last
        # What may still be the beginning of a packet waits for its end.
        self._rest = stream[max(0, len(stream) - (SIZE - 1)) :].copy()
        return self._count_on(last, packets, anew)

    def _in_order(self, last: Packets, starts: Indices, packets: Packets) -> bool:
        """Whether there is nothing to choose."""
        follows_bytes = np.diff(starts, prepend=self._used - SIZE) >= SIZE
        if self._doubtful or not (follows_bytes & _comes_next(last, packets, self._period_us)).all():
            return False
        if len(packets):
            steps, times = _steps(last, packets)
            self._period_us += PERIOD_GAIN * (float(times.sum() / steps.sum()) - self._period_us)
            self._used = int(starts[-1]) + SIZE
        return True

    def _choose(self, starts: Indices, packets: Packets) -> tuple[Packets, npt.NDArray[np.int64]]:
        """Choose the packets that count. Returns them, (n,), and (n,), 1 where the firmware began anew with the packet,
        else 0. One that comes next may share bytes with the one before: that may have lost its last ones, and the
        first of the next were the same."""
        chosen, anew, last = [packets[:0]], [0] * 0, self._last
        for k, at in enumerate(starts.tolist()):
            found = _Found(packets[k : k + 1].copy(), at)
            comes_next = last is not None and _comes_next(last, found.packet, self._period_us).all()
            if not comes_next and (at < self._used or _is_repeat(last, found.packet)):
                continue
            if comes_next:
                counting = [*self._between(last, found), found]
            else:
                counting = self._chain_to(found, 1 if last is None else CONFIRMED_BY)
            if not counting:
                self._doubtful = [*self._doubtful[1 - MOST_DOUBTFUL :], found]
                continue
            for each in counting:
                anew.append(int(last is not None and not _follows(last, each.packet).all()))
                chosen.append(each.packet)
                last = each.packet
                self._shared += max(0, self._used - each.at)
                self._used = each.at + SIZE
            self._doubtful = []
        return np.concatenate(chosen), np.array(anew, dtype=np.int64)

    def _between(self, last: Packets | None, found: _Found) -> list[_Found]:
        """The doubtful packets whose bytes, numbers and times lie between the last one that counts and this one: the
        board stamped or sent them late."""
        between, used = [found][:0], self._used
        for doubtful in self._doubtful:
            inside = doubtful.at >= used and doubtful.at + SIZE <= found.at
            if last is None or not inside or not _follows(last, doubtful.packet).all():
                continue
            if _follows(doubtful.packet, found.packet).all():
                between.append(doubtful)
                last, used = doubtful.packet, doubtful.at + SIZE
        return between

    def _chain_to(self, found: _Found, before: int) -> list[_Found]:
        """So many doubtful packets, each followed by the next and the last by this one, and itself; or none."""
        for before_it in combinations(self._doubtful[::-1], before):
            chain = [*before_it[::-1], found]
            if all(_follows(this.packet, other.packet).all() for this, other in pairwise(chain)):
                steps, times = _steps(chain[-2].packet, found.packet)
                self._period_us = float(times[0] / steps[0])
                return chain
        return []

    def _count_on(self, last: Packets | None, packets: Packets, anew: npt.NDArray[np.int64]) -> Samples:
        """last: the packet before these, (1,). Where the firmware began anew number and time go on by a step: what
        was lost meanwhile is not known."""
        was = self.counts
        if last is None and len(packets):
            last = packets[:1]
            self._sequence, self._time_us = int(last["sequence"][0]) - 1, int(last["time_us"][0]) - 1
            steps, times = _steps(last, packets)
            steps[0] = times[0] = 1
        else:
            steps, times = _steps(last, packets) if last is not None else (np.zeros(0, np.int64),) * 2
        steps, times = np.where(anew, 1, steps), np.where(anew, 1, times)
        sequence, time_us = self._sequence + np.cumsum(steps), self._time_us + np.cumsum(times)
        if len(packets):
            self._sequence, self._time_us = int(sequence[-1]), int(time_us[-1])
        self.counts = Counts(
            packets=was.packets + len(packets),
            lost=was.lost + int((steps - 1).sum()),
            spoiled_bytes=max(was.spoiled_bytes, self._count_judged_bytes() - SIZE * (was.packets + len(packets))),
            restarts=was.restarts + int(anew.sum()),
        )
        return Samples(sequence, time_us, packets["raw"], was.restarts + np.cumsum(anew))

    def _count_judged_bytes(self) -> int:
        """Bytes that no later ones can make part of a packet."""
        judged = max(self._used, self._received - len(self._rest))
        return judged + self._shared - sum(min(SIZE, max(0, judged - doubtful.at)) for doubtful in self._doubtful)


def _steps(last: Packets, packets: Packets) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """(n,) each: how far number and time of each packet, µs, are beyond those of the one before."""
    both = np.concatenate((last, packets))
    numbers, times = both["sequence"].astype(np.int64), both["time_us"].astype(np.int64)
    return np.diff(numbers) % 2**16, np.diff(times) % 2**32


def _follows(last: Packets, packets: Packets) -> npt.NDArray[np.bool_]:
    """(n,): whether each packet may be of the same clock as the one before and later. The one before may have been
    stamped late, by less than a period: of two in a row nothing but the order of their times is known."""
    steps, times = _steps(last, packets)
    return (steps > 0) & (steps < 2**15) & (times > SHORTEST_PERIOD_US * (steps - 1)) & (times < LONGEST_SILENCE_US)


def _is_repeat(last: Packets | None, packet: Packets) -> bool:
    return last is not None and packet.tobytes() == last.tobytes()


def _comes_next(last: Packets, packets: Packets, period_us: float) -> npt.NDArray[np.bool_]:
    """(n,): whether each packet comes soon after the one before, at the board's rate. False for a period of NaN."""
    steps, times = _steps(last, packets)
    at_rate = np.abs(times - period_us * steps) <= period_us * (JITTER_SHARE + PERIOD_SHARE * steps)
    return at_rate & (times < NEXT_US) & _follows(last, packets)


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


def _packets_at(stream: Bytes, starts: Indices) -> Packets:
    packets: Packets = stream[starts[:, None] + np.arange(SIZE)].reshape(-1).view(LAYOUT)
    return packets
