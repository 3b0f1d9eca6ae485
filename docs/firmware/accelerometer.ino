/* ADXL335 on a Teensy 4.x: three analogue inputs at 4 kHz, one packet a sample over USB. Not yet run on a board. */
#include "packet.h"

static const int PINS[3] = {A0, A1, A2};
static const uint32_t PERIOD_US = 250;
static const int AVERAGED = 4;

static uint16_t sequence;
static uint32_t due_us;

void setup() {
  Serial.begin(2000000);
  analogReadResolution(12);
  due_us = micros();
}

void loop() {
  if ((int32_t)(micros() - due_us) < 0) return;
  uint8_t packet[HAPTEQ_PACKET_SIZE];
  uint32_t sum[3] = {0, 0, 0};
  uint16_t raw[3];
  uint32_t taken_us = micros();
  for (int k = 0; k < AVERAGED; k++)
    for (int axis = 0; axis < 3; axis++) sum[axis] += analogRead(PINS[axis]);
  for (int axis = 0; axis < 3; axis++) raw[axis] = (uint16_t)(sum[axis] * 16 / AVERAGED);
  hapteq_packet(packet, sequence++, taken_us, raw);
  Serial.write(packet, sizeof packet);
  due_us += PERIOD_US;
  /* After a stall: no burst of old samples, the sequence shows no loss because none was taken. */
  if ((int32_t)(micros() - due_us) > (int32_t)(4 * PERIOD_US)) due_us = micros() + PERIOD_US;
}
