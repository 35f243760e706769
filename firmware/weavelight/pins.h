// Wiring: which pin of an Arduino Uno drives what. README.md has it as a table.
// D0 and D1 are the serial port; D13 is not used because the bootloader blinks the LED on it.
#pragma once

#include <Arduino.h>
#include "config.h"

static const uint8_t LIGHT_PINS[] = {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, A1, A2, A3, A4, A5, 12};
static const uint8_t BACK_LIGHT_PIN = 12;
static const uint8_t TRIGGER_PIN = A0;

#if LIGHT_COUNT < 1 || LIGHT_COUNT > 16
#error "LIGHT_COUNT in config.h must be 1 to 16"
#endif
#if LIGHT_COUNT == 16 && HAS_BACK_LIGHT
#error "Light 15 and the back light share pin 12: set HAS_BACK_LIGHT to 0, or LIGHT_COUNT to 15 or less, in config.h"
#endif
