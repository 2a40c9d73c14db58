// SPI bridge for a BioTac: batches of SPI transfers from a serial port, carried out without the host.
//
// Version 1 of the format in docs/links.md ("The SPI bridge"). For boards of the Arduino family with 40 KB of memory or
// more and a USB port of their own, such as Teensy 4 or Arduino Due; it has run on no real board yet. Wiring: SCK, MOSI
// and MISO of the board's SPI, and a select pin for each sensor (`LINES`); a level of 3.3 V; a supply of 3.3 to 5 V.

#include <Arduino.h>
#include <SPI.h>
#include <string.h>

const uint8_t VERSION = 1, HOLDS = 8;            // of the format; batches held, the running one included
const uint16_t FIRMWARE = 1, LARGEST = 1024;     // bytes of payload
const uint32_t FASTEST_HZ = 10000000;            // what a BioTac takes
const uint8_t LINES[] = {10, 9, 8};              // pins of the select lines, low is active; line i is bit i of a mask
const char NAME[] = "biotac_bridge";
const uint8_t N_LINES = sizeof(LINES), ALL_LINES = (1 << N_LINES) - 1;
const uint8_t HELLO = 0x01, SETUP = 0x02, BATCH = 0x03, REFUSED = 0x7F, REPLY = 0x80;
const uint16_t HEAD = 6, CRC = 4, STEP = 5, ROOM = (HEAD + LARGEST + CRC) / 254 + HEAD + LARGEST + CRC + 2;

struct Batch {
  uint16_t number, length;
  uint8_t payload[LARGEST];
};

Batch batches[HOLDS];
uint8_t first = 0, held = 0;                     // the oldest batch, and how many wait or run
bool running = false;
uint16_t place, answered;                        // in the running batch, and bytes of its reply
uint32_t released_us, pause_us;                  // when the lines were released, and for how long nothing is selected
uint8_t in[ROOM], out[HEAD + LARGEST + CRC + 4]; // a stuffed frame as it comes; a frame as it is sent, not yet stuffed
uint8_t answer[LARGEST + 4];
uint16_t in_length = 0;
bool too_long = false;
uint32_t speed_hz = 0;
SPISettings bus;

uint16_t u16(const uint8_t *at) { return at[0] | at[1] << 8; }
uint32_t u32(const uint8_t *at) { return u16(at) | (uint32_t)u16(at + 2) << 16; }

void put(uint8_t *at, uint32_t value, uint8_t bytes) {
  for (; bytes--; value >>= 8) *at++ = value;
}

uint32_t crc32(const uint8_t *data, uint16_t length) {  // IEEE 802.3, by half bytes
  uint32_t crc = 0xFFFFFFFF;
  while (length--) {
    crc ^= *data++;
    for (uint8_t bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

void send(uint8_t kind, uint16_t number, const uint8_t *payload, uint16_t length) {
  out[0] = VERSION;
  out[1] = kind;
  put(out + 2, number, 2);
  put(out + 4, length, 2);
  memcpy(out + HEAD, payload, length);
  put(out + HEAD + length, crc32(out, HEAD + length), 4);
  uint16_t end = HEAD + length + CRC, begin = 0;
  while (begin <= end) {                         // consistent overhead byte stuffing
    uint16_t stop = begin;
    while (stop < end && out[stop] && stop - begin < 254) stop++;
    Serial.write((uint8_t)(stop - begin + 1));
    Serial.write(out + begin, stop - begin);
    begin = stop - begin == 254 && stop < end ? stop : stop + 1;
  }
  Serial.write((uint8_t)0);
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

void take(const uint8_t *frame, uint16_t length) {
  if (length < HEAD + CRC || u16(frame + 4) != length - HEAD - CRC) return;
  if (u32(frame + length - CRC) != crc32(frame, length - CRC)) return;
  uint8_t kind = frame[1];
  uint16_t number = u16(frame + 2), size = u16(frame + 4);
  const uint8_t *payload = frame + HEAD;
  if (frame[0] != VERSION) return refuse(number, "version is unknown");
  if (size > LARGEST) return refuse(number, "payload is too large");
  if (kind == HELLO) {
    uint8_t about[6 + sizeof(NAME) - 1];
    put(about, FIRMWARE, 2);
    put(about + 2, LARGEST, 2);
    about[4] = HOLDS;
    about[5] = ALL_LINES;
    memcpy(about + 6, NAME, sizeof(NAME) - 1);
    send(HELLO | REPLY, number, about, sizeof(about));
  } else if (kind == SETUP) {
    if (size != 5) return refuse(number, "malformed payload");
    if (!u32(payload) || payload[4] > 3) return refuse(number, "clock or mode is not possible");
    const uint8_t modes[] = {SPI_MODE0, SPI_MODE1, SPI_MODE2, SPI_MODE3};
    speed_hz = min(u32(payload), FASTEST_HZ);
    bus = SPISettings(speed_hz, MSBFIRST, modes[payload[4]]);
    uint8_t runs[5];
    put(runs, speed_hz, 4);
    runs[4] = payload[4];
    send(SETUP | REPLY, number, runs, 5);
  } else if (kind == BATCH) {
    if (!speed_hz) return refuse(number, "not set up");
    if (!whole(payload, size)) return refuse(number, "malformed payload");
    if (held == HOLDS) return refuse(number, "full");
    Batch &batch = batches[(first + held++) % HOLDS];
    batch.number = number;
    batch.length = size;
    memcpy(batch.payload, payload, size);
  } else {
    refuse(number, "kind is unknown");
  }
}

// Takes what has come from the host, at most so many bytes: a batch that runs is looked at in between.
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

// Carries out the next step of the running batch if the pause before it is over; answers when the last one is.
void run() {
  if (!held || (running && micros() - released_us < pause_us)) return;
  Batch &batch = batches[first];
  if (!running) {
    running = true;
    place = pause_us = 0;
    answered = 4;
    put(answer, micros(), 4);
    return;
  }
  if (place == batch.length) {
    send(BATCH | REPLY, batch.number, answer, answered);
    first = (first + 1) % HOLDS;
    held--;
    running = false;
    return;
  }
  const uint8_t *step = batch.payload + place;
  uint16_t bytes = u16(step + 3);
  if (bytes) {
    SPI.beginTransaction(bus);
    choose(step[0], LOW);
    for (uint16_t n = 0; n < bytes; n++) answer[answered++] = SPI.transfer(step[STEP + n]);
    choose(step[0], HIGH);
    SPI.endTransaction();
  }
  released_us = micros();
  pause_us = u16(step + 1);
  place += STEP + bytes;
}

void setup() {
  for (uint8_t line = 0; line < N_LINES; line++) {
    pinMode(LINES[line], OUTPUT);
    digitalWrite(LINES[line], HIGH);
  }
  SPI.begin();
  Serial.begin(115200);
}

void loop() {
  run();
  listen(64);
}
