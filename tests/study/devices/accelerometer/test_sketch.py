"""The firmware's sketch, compiled over a stand-in for Arduino.h: setup, loop, and what the reader makes of them."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from study.devices.accelerometer.parser import PACKET_SIZE, PacketParser

FIRMWARE = Path(__file__).parents[4] / "docs" / "firmware"
STAND_INS = Path(__file__).parent / "stand_ins"
POLL_US, PERIOD_US = 10, 250

# The Arduino tools put Arduino.h before a sketch. A stall: the board does something else for 5 ms.
MAIN = f"""
#include "Arduino.h"
#include "accelerometer.ino"
int main(int count, char **words) {{
  if (count != 3) return 1;
  long polls = std::atol(words[1]), stall_at = std::atol(words[2]);
  setup();
  for (long k = 0; k < polls; k++) {{
    if (k == stall_at) clock_us += 5000;
    loop();
    clock_us += {POLL_US};
  }}
  return 0;
}}
"""


@pytest.fixture(scope="module")
def sent(vendor, tmp_path_factory):
    """sent(polls, stall_at): the bytes that the board sends, with a stall before that poll (-1: none)."""
    source = tmp_path_factory.mktemp("sketch") / "main.cpp"
    source.write_text(MAIN)
    program = source.with_suffix(".out")
    strict = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{FIRMWARE}", f"-I{STAND_INS}"]
    command = [*vendor.cpp_compiler(), *strict, "-o", str(program), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr

    def run(polls: int, stall_at: int = -1) -> bytes:
        return subprocess.run([program, str(polls), str(stall_at)], capture_output=True, timeout=60, check=True).stdout

    return run


def test_the_sketch_sends_the_mean_of_its_inputs_at_4_khz_beyond_the_end_of_its_clock(sent):
    parser = PacketParser()
    samples = parser.feed(sent(40_000))
    assert len(samples) > 1500
    # The mean of four readings of 12 bits, in 16 bits: x from A0, y from A1, z from A2.
    assert (samples.raw == [16 * 1001.5, 16 * 2001.5, 16 * 3001.5]).all()
    assert (samples.sequence == np.arange(len(samples))).all()
    assert samples.time_us[0] < 2**32 < samples.time_us[-1]
    assert (np.diff(samples.time_us) == PERIOD_US).all()
    counts = parser.counts
    assert (counts.packets, counts.lost, counts.spoiled_bytes, counts.restarts) == (len(samples), 0, 0, 0)


def test_after_a_stall_of_the_board_no_old_samples_come_in_a_burst(sent):
    data = sent(20_000, stall_at=5_000)
    parser = PacketParser()
    samples = parser.feed(data)
    assert len(data) == PACKET_SIZE * len(samples)
    apart_us = np.diff(samples.time_us)
    assert apart_us.max() >= 5000 and (apart_us >= PERIOD_US).all()
    assert (apart_us > 2 * PERIOD_US).sum() == 1
    assert (parser.counts.lost, parser.counts.restarts) == (0, 0)
