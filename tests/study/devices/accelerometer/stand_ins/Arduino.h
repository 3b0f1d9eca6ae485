/* As much of the Arduino core of a Teensy as docs/firmware/accelerometer.ino uses. Its clock stands still but for what
 * `clock_us` is moved by and for READ_US a conversion, and begins a little before its 32 bits are full. Serial bytes go
 * to the standard output. */
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

static const uint8_t A0 = 14, A1 = 15, A2 = 16;
static const uint32_t READ_US = 5;

static uint32_t clock_us = 0xFFFFFFFFu - 100000u;
static unsigned resolution_bits = 10;
static unsigned reads_of[3];

static inline uint32_t micros() { return clock_us; }
static inline void analogReadResolution(unsigned bits) { resolution_bits = bits; }

/* 1000, 2000 and 3000 of 4095 at the first, second and third input, and 0 to 3 more from one reading to the next. */
static inline int analogRead(uint8_t pin) {
  unsigned axis = static_cast<unsigned>(pin - A0);
  if (axis > 2) std::abort();
  clock_us += READ_US;
  unsigned of_4095 = 1000u * (axis + 1u) + reads_of[axis]++ % 4u;
  return static_cast<int>(resolution_bits >= 12 ? of_4095 << (resolution_bits - 12) : of_4095 >> (12 - resolution_bits));
}

struct SerialLine {
  bool begun = false;
  void begin(unsigned long) { begun = true; }
  std::size_t write(const uint8_t *bytes, std::size_t size) {
    if (!begun) std::abort();
    return std::fwrite(bytes, 1, size, stdout);
  }
};
static SerialLine Serial;
