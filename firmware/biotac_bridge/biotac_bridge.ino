// SPI bridge for a BioTac: batches of SPI transfers from a serial port, carried out without the host.
//
// Version 1 of the format in docs/links.md ("The SPI bridge"). For Teensy 4.0 and 4.1, whose `Serial` is their native USB
// port; it has run on no real board yet. Wiring: docs/hardware.md, with a pull-up at each select line for the reset.

#include <string.h>
#include "board.h"

const uint8_t VERSION = 1, HOLDS = 8;            // of the format; batches held until they are answered, a power of 2
const uint16_t FIRMWARE = 2, LARGEST = 1024;     // bytes of payload
const uint32_t FASTEST_HZ = 10000000;            // what a BioTac takes
const float TICK_US = 5;                         // between two looks at the running batch
const uint8_t LINES[] = {10, 9, 8};              // pins of the select lines, low is active; line i is bit i of a mask
const char NAME[] = "biotac_bridge";
const uint8_t N_LINES = sizeof(LINES), ALL_LINES = (1 << N_LINES) - 1;
const uint8_t HELLO = 0x01, SETUP = 0x02, BATCH = 0x03, REFUSED = 0x7F, REPLY = 0x80;
const uint16_t HEAD = 6, CRC = 4, STEP = 5, FRAME = HEAD + LARGEST + CRC, ROOM = FRAME + FRAME / 254 + 2;

struct Batch {
  uint16_t number, length, answered;             // bytes of steps, and of the reply, which is written over them
  SPISettings bus;                               // as it was set up when the batch came
  uint8_t payload[LARGEST];
};

Batch batches[HOLDS];
volatile uint8_t taken = 0, ran = 0, told = 0;   // batches that came, were carried out (by the timer), were answered
bool running = false;
uint16_t place;                                  // in the running batch
uint32_t released_us, pause_us;                  // when the lines were released, and for how long nothing is selected
uint8_t in[ROOM], frame[FRAME], out[3 * ROOM];   // a stuffed frame as it comes; one as it is; stuffed ones to be sent
uint16_t in_length = 0, out_begin = 0, out_end = 0;
bool too_long = false;
uint32_t speed_hz = 0;
SPISettings bus;

uint16_t u16(const uint8_t *at) { return at[0] | at[1] << 8; }
uint32_t u32(const uint8_t *at) { return u16(at) | (uint32_t)u16(at + 2) << 16; }
void put(uint8_t *at, uint32_t value, uint8_t bytes) {
  for (; bytes--; value >>= 8) *at++ = value;
}

uint32_t crc32(const uint8_t *data, uint16_t length) {  // IEEE 802.3, bit by bit
  uint32_t crc = 0xFFFFFFFF;
  while (length--) {
    crc ^= *data++;
    for (uint8_t bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

// Puts a reply into what is to be sent; false: there is no room, and nothing waits for it.
bool send(uint8_t kind, uint16_t number, const uint8_t *payload, uint16_t length) {
  uint16_t end = HEAD + length + CRC, begin = 0;
  if (out_end + end + end / 254 + 2 > (int)sizeof(out)) return false;
  put(frame, VERSION | kind << 8 | (uint32_t)number << 16, 4);
  put(frame + 4, length, 2);
  memcpy(frame + HEAD, payload, length);
  put(frame + HEAD + length, crc32(frame, HEAD + length), 4);
  while (begin <= end) {                         // consistent overhead byte stuffing
    uint16_t stop = begin;
    while (stop < end && frame[stop] && stop - begin < 254) stop++;
    out[out_end++] = stop - begin + 1;
    memcpy(out + out_end, frame + begin, stop - begin);
    out_end += stop - begin;
    begin = stop - begin == 254 && stop < end ? stop : stop + 1;
  }
  out[out_end++] = 0;
  return true;
}

// Hands over as much as the port takes without waiting for the host.
void pump() {
  int most = min((int)Serial.availableForWrite(), out_end - out_begin);
  if (most > 0) out_begin += Serial.write(out + out_begin, most);
  if (out_begin == out_end) out_begin = out_end = 0;
}

void refuse(uint16_t number, const char *why) { send(REFUSED | REPLY, number, (const uint8_t *)why, strlen(why)); }
// Returns whether a payload is a list of whole steps on lines that there are.
bool whole(const uint8_t *payload, uint16_t length) {
  uint32_t at = 0;
  while (at < length) {
    if (at + STEP > length || payload[at] & ~ALL_LINES) return false;
    at += STEP + u16(payload + at + 3);
  }
  return length && at == length;
}

void take(const uint8_t *came, uint16_t length) {
  if (length < HEAD + CRC || u16(came + 4) != length - HEAD - CRC) return;
  if (u32(came + length - CRC) != crc32(came, length - CRC)) return;
  uint8_t kind = came[1];
  uint16_t number = u16(came + 2), size = u16(came + 4);
  const uint8_t *payload = came + HEAD;
  if (came[0] != VERSION) return refuse(number, "version is unknown");
  if (size > LARGEST) return refuse(number, "payload is too large");
  if (kind == HELLO) {
    uint8_t about[6 + sizeof(NAME) - 1];
    put(about, FIRMWARE | (uint32_t)LARGEST << 16, 4);
    put(about + 4, HOLDS | ALL_LINES << 8, 2);
    memcpy(about + 6, NAME, sizeof(NAME) - 1);
    send(HELLO | REPLY, number, about, sizeof(about));
  } else if (kind == SETUP) {
    if (size != 5) return refuse(number, "malformed payload");
    uint32_t hz = real_hz(min(u32(payload), FASTEST_HZ));
    if (!hz || payload[4] > 3) return refuse(number, "clock or mode is not possible");
    const uint8_t modes[] = {SPI_MODE0, SPI_MODE1, SPI_MODE2, SPI_MODE3};
    bus = SPISettings(speed_hz = hz, MSBFIRST, modes[payload[4]]);
    uint8_t runs[5] = {0, 0, 0, 0, payload[4]};
    put(runs, speed_hz, 4);
    send(SETUP | REPLY, number, runs, 5);
  } else if (kind == BATCH) {
    if (!speed_hz) return refuse(number, "not set up");
    if (!whole(payload, size)) return refuse(number, "malformed payload");
    if ((uint8_t)(taken - told) == HOLDS) return refuse(number, "full");
    Batch &batch = batches[taken % HOLDS];
    batch.number = number;
    batch.length = size;
    batch.bus = bus;
    memcpy(batch.payload, payload, size);
    taken = taken + 1;
  } else {
    refuse(number, "kind is unknown");
  }
}

// Takes what has come from the host, at most so many bytes.
void listen(uint8_t most) {
  while (most-- && Serial.available()) {
    uint8_t byte = Serial.read();
    if (byte) {
      if (in_length < ROOM) in[in_length++] = byte;
      else too_long = true;
      continue;
    }
    uint16_t to = 0, from = 0;                   // unstuffed in place
    while (from < in_length && !too_long) {
      uint16_t next = from + in[from];
      bool zero = in[from] < 0xFF && next < in_length;
      if (next > in_length) break;
      while (++from < next) in[to++] = in[from];
      if (zero) in[to++] = 0;
    }
    if (from == in_length && to) take(in, to);
    in_length = too_long = 0;
  }
}

void choose(uint8_t mask, uint8_t level) {
  for (uint8_t line = 0; line < N_LINES; line++)
    if (mask & 1 << line) digitalWrite(LINES[line], level);
}

// The timer's interrupt: carries out the next step of the oldest batch once the pause before it is over.
void tick() {
  if (ran == taken || (running && micros() - released_us < pause_us)) return;
  Batch &batch = batches[ran % HOLDS];
  uint32_t now_us = micros();
  if (!running) {
    running = true;
    place = batch.answered = 0;
  } else if (place == batch.length) {
    running = false;
    ran = ran + 1;
    return;
  }
  uint8_t mask = batch.payload[place];
  const uint8_t *sent = batch.payload + place + STEP;
  pause_us = u16(batch.payload + place + 1);
  uint16_t bytes = u16(batch.payload + place + 3);
  place += STEP + bytes;
  if (!batch.answered) put(batch.payload, now_us, batch.answered = 4);  // a step's head has 5 bytes: what is behind stays
  if (bytes) {
    SPI.beginTransaction(batch.bus);
    choose(mask, LOW);
    while (bytes--) batch.payload[batch.answered++] = SPI.transfer(*sent++);
    choose(mask, HIGH);
    SPI.endTransaction();
  }
  released_us = micros();
}

void setup() {
  for (uint8_t line = 0; line < N_LINES; line++) {
    digitalWrite(LINES[line], HIGH);             // before it is an output: a sensor would see a pulse
    pinMode(LINES[line], OUTPUT);
  }
  SPI.begin();
  Serial.begin(0);                               // USB has no bit rate
  start_timer(tick, TICK_US);
}

void loop() {
  pump();
  if (told != ran) {
    Batch &batch = batches[told % HOLDS];
    told = told + send(BATCH | REPLY, batch.number, batch.payload, batch.answered);
  }
  listen(64);
}
