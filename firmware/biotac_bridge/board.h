// What the sketch needs of its board: a native USB port (`Serial`), an interrupt by a timer, and the clocks of its SPI.
#pragma once
#include <Arduino.h>
#include <SPI.h>

#ifndef __IMXRT1062__
#error "This is for Teensy 4.0 and 4.1. State here what another board has."
#endif

// Lets a timer call a function every so many microseconds, before the interrupts of USB (128).
inline void start_timer(void (*call)(), float period_us) {
  static IntervalTimer timer;
  timer.priority(64);
  timer.begin(call, period_us);
}

// Returns the fastest clock that the bus has and that is not above the wanted one, as Teensyduino's SPI divides; 0: none.
inline uint32_t real_hz(uint32_t wanted_hz) {
  const uint32_t roots[] = {664615384, 720000000, 528000000, 396000000};
  uint32_t base = roots[CCM_CBCMR >> 4 & 3] / ((CCM_CBCMR >> 26 & 7) + 1);
  uint32_t parts = wanted_hz ? base / wanted_hz + (base % wanted_hz != 0) : 0;
  return parts < 1 || parts > 257 ? 0 : base / (parts < 2 ? 2 : parts);
}
