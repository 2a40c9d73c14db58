// What the sketch uses of Arduino, on a computer: Serial is stdin and stdout, the bus answers the complement of a byte.
#pragma once
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <thread>
using std::min;
#define __IMXRT1062__
const uint32_t CCM_CBCMR = 2u << 26 | 1u << 4;  // as Teensyduino's SPI.begin() sets it: 720 MHz / 3
enum { LOW, HIGH, OUTPUT, MSBFIRST, SPI_MODE0 = 0, SPI_MODE1 = 4, SPI_MODE2 = 8, SPI_MODE3 = 12 };

inline uint32_t micros() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000000ull + now.tv_nsec / 1000;
}

inline uint8_t levels[64];  // of the pins
inline void pinMode(uint8_t pin, uint8_t) {
  if (levels[pin] == LOW) exit(3);  // an output that begins low selects a sensor
}
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
  int availableForWrite() {
    pollfd one = {1, POLLOUT, 0};
    return poll(&one, 1, 0) > 0 ? 512 : 0;  // a pipe takes so much then, or it is full
  }
  size_t write(const uint8_t *data, size_t length) {
    ssize_t sent = ::write(1, data, length);
    if (sent < 0) exit(1);
    return sent;
  }
};
inline HostSerial Serial;

struct IntervalTimer {  // an interrupt, by a thread
  void priority(uint8_t) {}
  void begin(void (*call)(), float period_us) {
    std::thread([=] {
      for (;;) {
        call();
        usleep((unsigned)period_us);
      }
    }).detach();
  }
};
