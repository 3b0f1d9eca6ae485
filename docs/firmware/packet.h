/* A packet of the accelerometer, 16 bytes, the low byte first: sync A5 5A, sequence number, time stamp in microseconds,
 * x, y, z, CRC-16/CCITT-FALSE of bytes 2 to 13. Plain C, for any microcontroller; compiled and compared with the reader
 * in tests/study/devices/accelerometer. */
#ifndef HAPTEQ_PACKET_H
#define HAPTEQ_PACKET_H

#include <stdint.h>

#define HAPTEQ_PACKET_SIZE 16

static void hapteq_packet(uint8_t *out, uint16_t sequence, uint32_t time_us, const uint16_t raw[3]) {
  uint16_t crc = 0xFFFF;
  int i, bit;
  out[0] = 0xA5, out[1] = 0x5A;
  out[2] = (uint8_t)sequence, out[3] = (uint8_t)(sequence >> 8);
  for (i = 0; i < 4; i++) out[4 + i] = (uint8_t)(time_us >> (8 * i));
  for (i = 0; i < 3; i++) out[8 + 2 * i] = (uint8_t)raw[i], out[9 + 2 * i] = (uint8_t)(raw[i] >> 8);
  for (i = 2; i < 14; i++) {
    crc ^= (uint16_t)(out[i] << 8);
    for (bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
  }
  out[14] = (uint8_t)crc, out[15] = (uint8_t)(crc >> 8);
}

#endif
