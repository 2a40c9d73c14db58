#pragma once
#include <Arduino.h>

struct SPISettings {
  uint32_t hz;
  SPISettings(uint32_t hz = 0, uint8_t = 0, uint8_t = 0) : hz(hz) {}
};

struct HostSpi {
  void begin() {}
  uint32_t hz = 0;
  void beginTransaction(SPISettings settings) { hz = settings.hz; }
  void endTransaction() {}
  // A sensor on the first line, pin 10, answers; on the second, pin 9, one that says the clock in 100 kHz.
  uint8_t transfer(uint8_t byte) { return !levels[10] ? ~byte : !levels[9] ? hz / 100000 : 0xFF; }
};
inline HostSpi SPI;
