// What the sketch uses of Arduino, on a computer: Serial is stdin and stdout, the bus answers the complement of a byte.
#pragma once
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
using std::min;
enum { LOW, HIGH, OUTPUT, MSBFIRST, SPI_MODE0 = 0, SPI_MODE1 = 4, SPI_MODE2 = 8, SPI_MODE3 = 12 };

inline uint32_t micros() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000000ull + now.tv_nsec / 1000;
}

inline uint8_t levels[64];  // of the pins
inline void pinMode(uint8_t, uint8_t) {}
inline void digitalWrite(uint8_t pin, uint8_t level) { levels[pin] = level; }

struct HostSerial {
  void begin(long) {}
  int available() {
    pollfd one = {0, POLLIN, 0};
    return poll(&one, 1, 0) > 0;
  }
  int read() {
    uint8_t byte;
    if (::read(0, &byte, 1) != 1) exit(0);  // the test has closed it
    return byte;
  }
  void write(uint8_t byte) { write(&byte, 1); }
  void write(const uint8_t *data, size_t length) {
    if (length && ::write(1, data, length) < 0) exit(1);
  }
};
inline HostSerial Serial;
