"""Packets out of bytes that were lost, torn and garbled: every good one is found, and what was bad is counted."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from study.devices.accelerometer.parser import CRC_BYTES, PACKET_SIZE, SYNC, PacketParser, compute_crc
from tests.slow_instances import slow, slow_rows
from tests.study.devices.accelerometer.pty_board import encode_packets

FIRMWARE = Path(__file__).parents[4] / "docs" / "firmware"


def stream(count: int, first: int = 0, seed: int = 1) -> tuple[bytes, np.ndarray]:
    raw = np.random.default_rng(seed).integers(0, 2**16, (count, 3), dtype=np.uint16)
    numbers = first + np.arange(count)
    return encode_packets(numbers, 250 * numbers, raw), raw


def test_the_check_sum_is_the_published_one():
    """CRC-16/CCITT-FALSE of the digits 1 to 9 is 29B1."""
    assert compute_crc(np.frombuffer(b"123456789", dtype=np.uint8)[None]) == 0x29B1


def test_encoded_packets_are_decoded_unchanged():
    data, raw = stream(1000)
    parser = PacketParser()
    samples = parser.feed(data)
    assert (samples.raw == raw).all()
    assert (samples.sequence == np.arange(1000)).all()
    assert (samples.time_us == 250 * np.arange(1000)).all()
    assert (parser.counts.packets, parser.counts.lost, parser.counts.spoiled_bytes) == (1000, 0, 0)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(cuts=st.lists(st.integers(0, 100 * PACKET_SIZE), max_size=40))
def test_packets_are_decoded_from_bytes_split_anywhere(cuts):
    data, raw = stream(100)
    parser, found = PacketParser(), []
    for start, stop in zip([0, *sorted(cuts)], [*sorted(cuts), len(data)], strict=True):
        found.append(parser.feed(data[start:stop]).raw)
    assert (np.concatenate(found) == raw).all()
    assert parser.counts.spoiled_bytes == 0


def test_counters_and_times_continue_after_an_overflow():
    numbers = 65_500 + np.arange(100)
    times_us = 2**32 - 5000 + 250 * np.arange(100)
    samples = PacketParser().feed(encode_packets(numbers, times_us, np.zeros((100, 3))))
    assert (samples.sequence == numbers).all()
    assert (np.diff(samples.time_us) == 250).all()


def test_lost_packets_are_counted():
    data, _ = stream(100)
    parser = PacketParser()
    parser.feed(data[: 10 * PACKET_SIZE])
    parser.feed(data[13 * PACKET_SIZE : 50 * PACKET_SIZE] + data[90 * PACKET_SIZE :])
    assert parser.counts.lost == 3 + 40
    assert (parser.counts.packets, parser.counts.restarts) == (57, 0)


def test_a_firmware_restart_is_counted_and_time_continues():
    parser = PacketParser()
    first = parser.feed(stream(50, first=5000)[0])
    second = parser.feed(stream(50)[0])
    assert (parser.counts.restarts, parser.counts.lost) == (1, 0)
    assert second.sequence[0] == first.sequence[-1] + 1
    assert (np.diff(np.concatenate((first.time_us, second.time_us))) > 0).all()


@pytest.mark.parametrize(
    ("first", "times_us"),
    [
        (60_000, 9e8 + 250 * np.arange(50)),  # the new numbers look like 5536 lost packets: the time tells
        (100, 9e8 + 250 * np.arange(50)),
        (60_000, 2**32 - 12_500 + 250 * np.arange(50)),  # the time looks right, but not for 5536 lost packets
    ],
)
def test_a_clock_that_began_anew_is_told_apart(first, times_us):
    before = encode_packets(first + np.arange(50), times_us, np.zeros((50, 3)))
    parser = PacketParser()
    samples = parser.feed(before + stream(50)[0])
    assert samples.restarts.tolist() == [0] * 50 + [1] * 50
    assert (parser.counts.restarts, parser.counts.lost, parser.counts.packets) == (1, 0, 100)
    assert (np.diff(samples.sequence) == 1).all() and (np.diff(samples.time_us) > 0).all()


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_among_garbled_bytes_every_good_packet_is_found(seed):
    """Packets between stretches of noise that is full of sync bytes; some packets lose bytes, some have one changed."""
    random = np.random.default_rng(seed)
    count = 20_000
    data, raw = stream(count, seed=seed)
    fate = random.choice(["good", "torn", "flipped"], size=count, p=[0.8, 0.1, 0.1])
    pieces, starts = [], []
    for k in range(count):
        packet = bytearray(data[k * PACKET_SIZE : (k + 1) * PACKET_SIZE])
        if fate[k] == "torn":
            del packet[random.integers(0, PACKET_SIZE) :]
        elif fate[k] == "flipped":
            packet[random.integers(0, PACKET_SIZE)] ^= 1 << random.integers(0, 8)
        noise = random.integers(0, 256, random.integers(0, 80), dtype=np.uint8).tobytes()
        starts.append(sum(map(len, pieces[-3:])) + (starts[-1] if starts else 0))
        pieces += [bytes(packet), SYNC * int(random.integers(0, 3)), noise]
    garbled = b"".join(pieces)
    assert len(garbled) > 10**6
    parser, found, at = PacketParser(), [], 0
    while at < len(garbled):
        size = int(random.integers(1, 5000))
        found.append(parser.feed(garbled[at : at + size]))
        at += size
    numbers = np.concatenate([samples.sequence for samples in found])
    # A packet whose last byte was lost is whole all the same where the noise after it begins with that byte.
    whole = [
        k
        for k in range(count)
        if garbled[starts[k] : starts[k] + PACKET_SIZE] == data[k * PACKET_SIZE : (k + 1) * PACKET_SIZE]
    ]
    assert set(np.flatnonzero(fate == "good")) <= set(whole)
    assert numbers.tolist() == whole
    assert (np.concatenate([samples.raw for samples in found]) == raw[whole]).all()
    counts = parser.counts
    assert counts.packets == len(numbers)
    assert counts.packets + counts.lost == numbers[-1] - numbers[0] + 1
    assert 0 <= len(garbled) - PACKET_SIZE * counts.packets - counts.spoiled_bytes < PACKET_SIZE


def test_a_million_bytes_of_noise_are_no_packets():
    parser = PacketParser()
    noise = np.random.default_rng(4).integers(0, 256, 10**6, dtype=np.uint8).tobytes()
    assert len(parser.feed(noise)) == 0
    assert parser.counts.spoiled_bytes > 10**6 - PACKET_SIZE


def forged(tail: bytes, sequence: int) -> bytes:
    """Bytes that make with `tail`, which a real packet begins with, a packet whose check sum is right."""
    head = np.frombuffer(encode_packets(sequence, 123_456_789, [[0, 0, 0]])[: PACKET_SIZE - len(tail)], dtype=np.uint8)
    tries = np.tile(np.concatenate((head, np.frombuffer(tail, dtype=np.uint8))), (2**16, 1))
    tries[:, 4:6] = np.arange(2**16, dtype="<u2").view(np.uint8).reshape(-1, 2)  # of its time stamp: one of them fits
    right = compute_crc(tries[:, CRC_BYTES]) == tries[:, 14:16].copy().view("<u2")[:, 0]
    return tries[np.flatnonzero(right)[0], : PACKET_SIZE - len(tail)].tobytes()


@pytest.mark.parametrize("overlap", [2, 7, 10])
def test_a_false_packet_that_ends_in_a_real_one_does_not_hide_it(overlap):
    """However the bytes come: a parser that has used up those of the false one has lost the real one."""
    data, _ = stream(4)
    spoiled = (
        data[: 2 * PACKET_SIZE]
        + forged(data[2 * PACKET_SIZE : 2 * PACKET_SIZE + overlap], 777)
        + data[2 * PACKET_SIZE :]
    )
    for cut in range(len(spoiled)):
        parser = PacketParser()
        found = parser.feed(spoiled[:cut]).sequence.tolist() + parser.feed(spoiled[cut:]).sequence.tolist()
        assert found == [0, 1, 2, 3], cut
        assert (parser.counts.restarts, parser.counts.spoiled_bytes) == (0, PACKET_SIZE - overlap)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_false_packets_among_garbled_bytes_count_for_nothing(seed):
    """Whole ones with a right check sum, and ones that end in a real packet: neither hides, shifts nor restarts."""
    random = np.random.default_rng(seed)
    data, raw = stream(5000 if seed == 1 else 25_000, seed=seed)
    false = [encode_packets(int(random.integers(2**16)), int(random.integers(2**32)), [[1, 2, 3]]) for _ in range(50)]
    pieces = [data[: 2 * PACKET_SIZE]]
    for k in range(2, len(raw)):
        fate = random.random()
        if fate < 0.01:
            pieces.append(false[int(random.integers(len(false)))])
        elif fate < 0.011:
            pieces.append(forged(data[k * PACKET_SIZE : k * PACKET_SIZE + 6], int(random.integers(2**16))))
        else:
            pieces.append(random.integers(0, 256, int(random.integers(0, 50)), dtype=np.uint8).tobytes())
        pieces.append(data[k * PACKET_SIZE : (k + 1) * PACKET_SIZE])
    garbled, parser, found, at = b"".join(pieces), PacketParser(), [], 0
    assert len(garbled) > 40 * len(raw)
    while at < len(garbled):
        size = int(random.choice([1, 15, 16, 17, 64, 4096]))
        found.append(parser.feed(garbled[at : at + size]))
        at += size
    assert np.concatenate([samples.sequence for samples in found]).tolist() == list(range(len(raw)))
    assert (np.concatenate([samples.raw for samples in found]) == raw).all()
    assert (parser.counts.packets, parser.counts.lost, parser.counts.restarts) == (len(raw), 0, 0)
    assert parser.counts.spoiled_bytes == len(garbled) - PACKET_SIZE * len(raw)


def with_crc_ending_in(start: bytes, sequence: int) -> tuple[bytes, np.ndarray]:
    """A packet whose check sum ends in these bytes, and its raw values."""
    raw = np.random.default_rng(7).integers(0, 2**16, (2**18, 3), dtype=np.uint16)
    tries = encode_packets(np.full(len(raw), sequence), np.full(len(raw), 250 * sequence), raw)
    rows = np.frombuffer(tries, dtype=np.uint8).reshape(-1, PACKET_SIZE)
    found = np.flatnonzero((rows[:, -len(start) :] == np.frombuffer(start, dtype=np.uint8)).all(axis=1))[0]
    return rows[found].tobytes(), raw[found]


@pytest.mark.parametrize("lost", [1, 2])
def test_a_packet_that_lost_its_last_bytes_does_not_hide_the_next_that_begins_with_the_same(lost):
    """Then both are whole, however the bytes come."""
    data, raw = stream(4)
    torn, torn_raw = with_crc_ending_in(SYNC[:lost], 2)
    spoiled = data[: 2 * PACKET_SIZE] + torn[:-lost] + data[3 * PACKET_SIZE :]
    for cut in range(len(spoiled)):
        parser = PacketParser()
        samples = parser.feed(spoiled[:cut]), parser.feed(spoiled[cut:])
        assert np.concatenate([each.sequence for each in samples]).tolist() == [0, 1, 2, 3], cut
        assert (np.concatenate([each.raw for each in samples]) == [*raw[:2], torn_raw, raw[3]]).all()
        assert (parser.counts.packets, parser.counts.spoiled_bytes, parser.counts.lost) == (4, 0, 0)


@pytest.mark.parametrize("late_us", [750, *slow(75, 250)])
def test_packets_that_were_stamped_late_count(late_us):
    """Of two in a hundred by 0.3 to 3 periods, and the following ones as far as the board has to catch up."""
    rng = np.random.default_rng(late_us)
    numbers = np.arange(2500)
    due = 250 * numbers
    times = due + late_us * (rng.random(len(numbers)) < 0.02)
    for k in range(1, len(times)):
        times[k] = max(times[k], times[k - 1] + 60)
    data = encode_packets(numbers, times, rng.integers(0, 2**16, (len(numbers), 3), dtype=np.uint16))
    parser = PacketParser()
    samples = [parser.feed(data[at : at + 200]) for at in range(0, len(data), 200)]
    assert np.concatenate([each.sequence for each in samples]).tolist() == numbers.tolist()
    assert (parser.counts.lost, parser.counts.spoiled_bytes, parser.counts.restarts) == (0, 0, 0)


@pytest.mark.parametrize(("period_us", "late_us"), [(250, 249), *slow_rows((250, 205), (100, 99), (500, 499))])
def test_packets_that_were_stamped_just_before_the_next_count(period_us, late_us):
    """Late by all but 1 to 45 µs of a period, one in ten, some of them in a row."""
    rng = np.random.default_rng(late_us)
    numbers = np.arange(2500)
    times = period_us * numbers + late_us * (rng.random(len(numbers)) < 0.1)
    data = encode_packets(numbers, times, rng.integers(0, 2**16, (len(numbers), 3), dtype=np.uint16))
    parser = PacketParser()
    samples = [parser.feed(data[at : at + 200]) for at in range(0, len(data), 200)]
    assert np.concatenate([each.sequence for each in samples]).tolist() == numbers.tolist()
    assert (parser.counts.lost, parser.counts.spoiled_bytes, parser.counts.restarts) == (0, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_packets_that_come_again_or_lie_are_told_apart_among_garbled_ones(seed):
    """Repeats, old ones sent again, ones from the near future and from anywhere, two in a row as well."""
    random = np.random.default_rng(seed)
    data, raw = stream(20_000, seed=seed)
    pieces, good = [data[: 4 * PACKET_SIZE]], [0, 1, 2, 3]
    for k in range(4, len(raw)):
        packet, fate = data[k * PACKET_SIZE : (k + 1) * PACKET_SIZE], random.random()
        if fate < 0.8:
            good.append(k)
            pieces.append(packet * (1 + (fate < 0.05)))
        elif fate < 0.82:
            pieces.append(packet[: int(random.integers(PACKET_SIZE - 2))])
        elif fate < 0.825:
            late = good[-int(random.integers(1, 50)) :][0]
            pieces.append(encode_packets(late, 250 * late, raw[late][None]))
        elif fate < 0.83:
            pieces.append(encode_packets(k + int(random.integers(50)), 250 * k + 25_000, [[1, 2, 3]]))
        elif fate < 0.835:
            pieces.append(encode_packets(int(random.integers(2**16)), int(random.integers(2**32)), [[1, 2, 3]]))
        else:
            pieces.append(random.integers(0, 256, int(random.integers(0, 200)), dtype=np.uint8).tobytes())
    pieces.append(data[-PACKET_SIZE:])
    good = sorted({*good, len(raw) - 1})
    garbled, parser, found, at = b"".join(pieces), PacketParser(), [], 0
    while at < len(garbled):
        size = int(random.choice([1, 15, 16, 17, 64, 4096]))
        found.append(parser.feed(garbled[at : at + size]))
        at += size
    assert np.concatenate([samples.sequence for samples in found]).tolist() == good
    assert (np.concatenate([samples.raw for samples in found]) == raw[good]).all()
    counts = parser.counts
    assert (counts.packets, counts.lost, counts.restarts) == (len(good), len(raw) - len(good), 0)
    assert 0 <= len(garbled) - PACKET_SIZE * len(good) - counts.spoiled_bytes < PACKET_SIZE


def test_the_firmware_makes_the_same_packets(vendor, tmp_path):
    source = tmp_path / "firmware.c"
    source.write_text(
        '#include "packet.h"\n'
        "void make(uint8_t *out, uint16_t s, uint32_t t, const uint16_t *raw) { hapteq_packet(out, s, t, raw); }\n"
    )
    library = tmp_path / "firmware.so"
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", f"-I{FIRMWARE}"]
    subprocess.run([*vendor.compiler(), *strict, "-o", str(library), str(source)], check=True)
    make = ctypes.CDLL(str(library)).make
    make.argtypes = [ctypes.c_char_p, ctypes.c_uint16, ctypes.c_uint32, ctypes.c_void_p]
    random = np.random.default_rng(5)
    for _ in range(200):
        number, time_us = int(random.integers(2**16)), int(random.integers(2**32))
        raw = random.integers(0, 2**16, 3, dtype=np.uint16)
        out = ctypes.create_string_buffer(PACKET_SIZE)
        make(out, number, time_us, raw.ctypes.data)
        assert out.raw == encode_packets(number, time_us, raw[None])
