"""Parser of the accelerometer's byte stream, which may be interrupted, incomplete or garbled: it returns the samples of
the accepted packets, in order. Used by `serial_reader.SerialSource`.

A packet is searched at every byte, so that a garbled packet hides none of its neighbours. Arbitrary bytes have a
correct checksum once in 2^16 = 65 536 times. Therefore a packet with a correct checksum is accepted at once only where
its sequence number and time stamp are the expected ones at the board's sample rate; otherwise, as after a stall or a
restart of the microcontroller, it is doubtful and accepted only when two further packets follow it (one at the start of
the stream), or when it fits between two accepted packets.

A packet has 16 bytes, least significant byte first (`docs/firmware/packet.h` is the sender). Offset and length of:

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

from study.devices.accelerometer.samples import PacketCounts, Samples

Bytes = npt.NDArray[np.uint8]
"""Bytes of the stream as an array."""

PACKET_SIZE = 16
"""Number of bytes of a packet."""
SYNC = bytes((0xA5, 0x5A))
"""First two bytes of a packet."""
CRC_BYTES = slice(2, 14)
"""Slice of the bytes of a packet that its checksum covers."""
CRC_POLYNOMIAL, CRC_INITIAL = 0x1021, 0xFFFF
"""CRC-16-CCITT: generator polynomial and initial value."""

PACKET_DTYPE = np.dtype(
    [("sync", "<u2"), ("sequence", "<u2"), ("time_us", "<u4"), ("raw", "<u2", (3,)), ("crc", "<u2")]
)  # fmt: skip
"""Fields of a packet, as in the table above."""


def compute_crc(rows: Bytes) -> npt.NDArray[np.uint16]:
    """Compute the CRC-16/CCITT-FALSE (n,) of each row of bytes (n, k), byte by byte with a table."""
    crc = np.full(len(rows), CRC_INITIAL, dtype=np.uint16)
    for column in rows.T:
        crc = (crc << 8) ^ _CRC_TABLE[(crc >> 8) ^ column]
    return crc


def _make_crc_table() -> npt.NDArray[np.uint16]:
    """Make the table `_CRC_TABLE`: eight steps of the shift register for each value of a byte, most significant bit
    first."""
    table = np.arange(256, dtype=np.uint32) << 8
    for _ in range(8):
        table = np.where(table & 0x8000, (table << 1) ^ CRC_POLYNOMIAL, table << 1) & 0xFFFF
    return table.astype(np.uint16)


_CRC_TABLE = _make_crc_table()
"""(256,): change of the CRC register by each value of a byte."""


LONGEST_SILENCE_US = 10_000_000
"""Longest time (µs) between two packets of one clock. After a longer silence the relation to the host's clock is
estimated anew, as after a restart. Chosen."""

SHORTEST_PERIOD_US = 50
"""Shortest sample period (µs) of any board, chosen: a gap in the numbers that is too large for the time passed shows
another clock, that is, a restart."""

EXPECTED_WITHIN_US, JITTER_SHARE, PERIOD_SHARE = 1_000_000, 0.25, 0.01
"""A packet is accepted at once if its time stamp is less than EXPECTED_WITHIN_US (µs) after the last packet, and agrees
with its sequence number at the mean period, within JITTER_SHARE of a period plus PERIOD_SHARE of the time passed.
Chosen: wide enough for the jitter of a board's timer, and so narrow that arbitrary bytes hardly ever agree."""

PERIOD_GAIN = 0.1
"""Weight of a new period in the exponential mean of the periods. Chosen."""

CONFIRMING_PACKETS = 2
"""Number of earlier doubtful packets that a packet with an unexpected number or time must follow to be accepted
together with them (1 for the first packets of a stream). Two false packets may follow each other by chance, three in
practice do not."""

MAX_UNCONFIRMED = 8
"""Largest number of doubtful packets that are kept, the newest: more than occur by chance."""

Indices = npt.NDArray[np.intp]
"""Indices into an array of bytes."""
Packets = npt.NDArray[np.void]
"""Packets as an array of `PACKET_DTYPE`."""


class _CandidatePacket(NamedTuple):
    """A packet with a correct checksum."""

    packet: Packets
    """The packet, shape (1,)."""
    start: int
    """Index of its first byte in all bytes received."""


class PacketParser:
    """Parser of a board's byte stream: `feed` takes the bytes as they arrive, and returns the samples of the packets
    that are accepted. Other bytes are skipped and counted as spoiled."""

    def __init__(self) -> None:
        self._remainder: Bytes = np.zeros(0, dtype=np.uint8)
        self._last_packet: Packets | None = None
        """The newest accepted packet, shape (1,)."""
        self._doubtful_packets: list[_CandidatePacket] = []
        """Packets after it with an unexpected number or time, which later packets must confirm."""
        self._period_us = math.nan
        """Mean sample period (µs) by the board's clock; NaN before the first is known."""
        self._sequence, self._time_us = 0, 0
        """Number and time (µs) of the newest accepted packet, without the wrap-around of the counters."""
        self._received_bytes = self._used_bytes = self._shared_bytes = 0
        """Bytes received; bytes up to the end of the newest accepted packet; bytes shared by two such packets."""
        self.counts = PacketCounts()

    def feed(self, data: bytes) -> Samples:
        """Parse further bytes: return the samples of the packets that are accepted with them, and update `counts`."""
        stream = np.concatenate((self._remainder, np.frombuffer(data, dtype=np.uint8)))
        self._received_bytes += len(data)
        starts, last_packet = _find_packet_starts(stream), self._last_packet
        packets, starts = _read_packets(stream, starts), starts + (self._received_bytes - len(stream))
        if last_packet is not None and self._accept_in_order(last_packet, starts, packets):
            restarted = np.zeros(len(packets), dtype=np.int64)
        else:
            packets, restarted = self._choose_packets(starts, packets)
        self._last_packet = packets[-1:].copy() if len(packets) else last_packet
        # Up to 15 bytes at the end may be the beginning of a packet: they are kept for the next call.
        self._remainder = stream[max(0, len(stream) - (PACKET_SIZE - 1)) :].copy()
        return self._make_samples(last_packet, packets, restarted)

    def _accept_in_order(self, last_packet: Packets, starts: Indices, packets: Packets) -> bool:
        """Accept all packets if they are the expected ones without overlap (the usual, fast case): updates the mean
        period and the end of the used bytes. Returns False, and changes nothing, for any other packets. last_packet:
        the newest accepted packet, (1,); starts: (n,), index of the packets' first bytes in all bytes received."""
        follows_bytes = np.diff(starts, prepend=self._used_bytes - PACKET_SIZE) >= PACKET_SIZE
        if self._doubtful_packets or not (follows_bytes & _is_expected(last_packet, packets, self._period_us)).all():
            return False
        if len(packets):
            steps, steps_us = _compute_increments(last_packet, packets)
            self._period_us += PERIOD_GAIN * (float(steps_us.sum() / steps.sum()) - self._period_us)
            self._used_bytes = int(starts[-1]) + PACKET_SIZE
        return True

    def _choose_packets(self, starts: Indices, packets: Packets) -> tuple[Packets, npt.NDArray[np.int64]]:
        """Accept packets one by one, and keep the doubtful ones. Returns the accepted packets, (m,), and (m,): 1 where
        another clock begins with the packet (a restart, or a silence of `LONGEST_SILENCE_US`), else 0. An expected
        packet may share bytes with its predecessor: if the last bytes of the predecessor were lost and the next packet
        begins with the same values, its checksum is still correct."""
        accepted_blocks, restarted, last_packet = [packets[:0]], [0] * 0, self._last_packet
        for packet_index, start in enumerate(starts.tolist()):
            candidate = _CandidatePacket(packets[packet_index : packet_index + 1].copy(), start)
            is_expected = last_packet is not None and _is_expected(last_packet, candidate.packet, self._period_us).all()
            if not is_expected and (start < self._used_bytes or _is_repeat(last_packet, candidate.packet)):
                continue
            if is_expected:
                accepted_packets = [*self._select_packets_between(last_packet, candidate), candidate]
            else:
                accepted_packets = self._find_chain(candidate, 1 if last_packet is None else CONFIRMING_PACKETS)
            if not accepted_packets:
                self._doubtful_packets = [*self._doubtful_packets[1 - MAX_UNCONFIRMED :], candidate]
                continue
            for accepted_packet in accepted_packets:
                restarted.append(
                    int(last_packet is not None and not _can_follow(last_packet, accepted_packet.packet).all())
                )
                accepted_blocks.append(accepted_packet.packet)
                last_packet = accepted_packet.packet
                self._shared_bytes += max(0, self._used_bytes - accepted_packet.start)
                self._used_bytes = accepted_packet.start + PACKET_SIZE
            self._doubtful_packets = []
        return np.concatenate(accepted_blocks), np.array(restarted, dtype=np.int64)

    def _select_packets_between(
        self, last_packet: Packets | None, candidate: _CandidatePacket
    ) -> list[_CandidatePacket]:
        """Select the doubtful packets whose bytes, numbers and times lie between the last accepted packet and
        `candidate`: the board stamped or sent them late, so they are accepted too. Empty without a last packet."""
        confirmed_packets, used_end = [candidate][:0], self._used_bytes
        for doubtful in self._doubtful_packets:
            lies_between = doubtful.start >= used_end and doubtful.start + PACKET_SIZE <= candidate.start
            if last_packet is None or not lies_between or not _can_follow(last_packet, doubtful.packet).all():
                continue
            if _can_follow(doubtful.packet, candidate.packet).all():
                confirmed_packets.append(doubtful)
                last_packet, used_end = doubtful.packet, doubtful.start + PACKET_SIZE
        return confirmed_packets

    def _find_chain(self, candidate: _CandidatePacket, predecessor_count: int) -> list[_CandidatePacket]:
        """Find a chain of `predecessor_count` doubtful packets and `candidate`, in which each packet can follow its
        predecessor; empty if there is none. Sets the mean period from its last two packets."""
        for predecessors in combinations(self._doubtful_packets[::-1], predecessor_count):
            chain = [*predecessors[::-1], candidate]
            if all(_can_follow(packet.packet, next_packet.packet).all() for packet, next_packet in pairwise(chain)):
                steps, steps_us = _compute_increments(chain[-2].packet, candidate.packet)
                self._period_us = float(steps_us[0] / steps[0])
                return chain
        return []

    def _make_samples(self, last_packet: Packets | None, packets: Packets, restarted: npt.NDArray[np.int64]) -> Samples:
        """Convert packets to samples, with number and time (µs) unwrapped, and update `counts`. last_packet: the packet
        before these, (1,), None at the start of the stream; restarted: (n,), from `_choose_packets`. At a restart of
        the firmware number and time increase by 1, because the number of packets lost meanwhile is not known."""
        previous_counts = self.counts
        if last_packet is None and len(packets):
            last_packet = packets[:1]
            self._sequence, self._time_us = int(last_packet["sequence"][0]) - 1, int(last_packet["time_us"][0]) - 1
            steps, steps_us = _compute_increments(last_packet, packets)
            steps[0] = steps_us[0] = 1
        else:
            steps, steps_us = (
                _compute_increments(last_packet, packets) if last_packet is not None else (np.zeros(0, np.int64),) * 2
            )
        steps, steps_us = np.where(restarted, 1, steps), np.where(restarted, 1, steps_us)
        sequence, time_us = self._sequence + np.cumsum(steps), self._time_us + np.cumsum(steps_us)
        if len(packets):
            self._sequence, self._time_us = int(sequence[-1]), int(time_us[-1])
        self.counts = PacketCounts(
            packets=previous_counts.packets + len(packets),
            lost=previous_counts.lost + int((steps - 1).sum()),
            spoiled_bytes=max(
                previous_counts.spoiled_bytes,
                self._count_decided_bytes() - PACKET_SIZE * (previous_counts.packets + len(packets)),
            ),
            restarts=previous_counts.restarts + int(restarted.sum()),
        )
        return Samples(sequence, time_us, packets["raw"], previous_counts.restarts + np.cumsum(restarted))

    def _count_decided_bytes(self) -> int:
        """Count the bytes whose use is decided: no later byte can make them part of a further packet. Bytes of two
        overlapping packets count twice; bytes of doubtful packets do not count yet."""
        decided_end = max(self._used_bytes, self._received_bytes - len(self._remainder))
        return (
            decided_end
            + self._shared_bytes
            - sum(min(PACKET_SIZE, max(0, decided_end - doubtful.start)) for doubtful in self._doubtful_packets)
        )


def _compute_increments(last_packet: Packets, packets: Packets) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Compute, (n,) each, the increase of the number and of the time (µs) from each packet's predecessor, modulo the
    counters."""
    consecutive = np.concatenate((last_packet, packets))
    numbers, times_us = consecutive["sequence"].astype(np.int64), consecutive["time_us"].astype(np.int64)
    return np.diff(numbers) % 2**16, np.diff(times_us) % 2**32


def _can_follow(last_packet: Packets, packets: Packets) -> npt.NDArray[np.bool_]:
    """(n,): whether each packet may be a later one of the same clock as its predecessor. A time stamp may be late by
    less than a period, so that for consecutive numbers only the order of the times and the silence are tested."""
    steps, steps_us = _compute_increments(last_packet, packets)
    return (
        (steps > 0) & (steps < 2**15) & (steps_us > SHORTEST_PERIOD_US * (steps - 1)) & (steps_us < LONGEST_SILENCE_US)
    )


def _is_repeat(last_packet: Packets | None, packet: Packets) -> bool:
    """Whether the packet equals the last byte by byte; False without a last one."""
    return last_packet is not None and packet.tobytes() == last_packet.tobytes()


def _is_expected(last_packet: Packets, packets: Packets, period_us: float) -> npt.NDArray[np.bool_]:
    """(n,): whether number and time of each packet are expected after its predecessor, at the mean period (see
    `EXPECTED_WITHIN_US`). False for a period of NaN."""
    steps, steps_us = _compute_increments(last_packet, packets)
    matches_rate = np.abs(steps_us - period_us * steps) <= period_us * (JITTER_SHARE + PERIOD_SHARE * steps)
    return matches_rate & (steps_us < EXPECTED_WITHIN_US) & _can_follow(last_packet, packets)


def _find_packet_starts(stream: Bytes) -> Indices:
    """Find the positions (n,) in the stream at which packets with a correct checksum begin."""
    candidate_count = len(stream) - PACKET_SIZE + 1
    if candidate_count <= 0:
        return np.zeros(0, dtype=np.intp)
    starts: Indices = np.flatnonzero(
        (stream[:candidate_count] == SYNC[0]) & (stream[1 : candidate_count + 1] == SYNC[1])
    )
    packets = _read_packets(stream, starts)
    checked_bytes = packets.view(np.uint8).reshape(-1, PACKET_SIZE)[:, CRC_BYTES]
    valid_starts: Indices = starts[compute_crc(checked_bytes) == packets["crc"]]
    return valid_starts


def _read_packets(stream: Bytes, starts: Indices) -> Packets:
    """Read the packets (n,) of `PACKET_SIZE` bytes that begin at these positions (n,) of the stream."""
    packets: Packets = stream[starts[:, None] + np.arange(PACKET_SIZE)].reshape(-1).view(PACKET_DTYPE)
    return packets
