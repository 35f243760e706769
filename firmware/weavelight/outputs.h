// The pins: at most one light on, break before make, read-back, levels by pulse width, the trigger pulse.
#pragma once

#include <stdint.h>
#include "config.h"

// Outputs have the numbers of their bits in the read-back: lights from 0, then these two.
const uint8_t BACK_LIGHT = 16;
const uint8_t TRIGGER = 17;
const uint8_t NO_LIGHT = 255;
const uint8_t FULL_LEVEL = 255;

// Every output low, then an output. Before this call the pins float and the drivers' pull-downs hold them.
void outputs_begin();

// Makes `light` (an index, BACK_LIGHT or NO_LIGHT) the only one on, at `level` 1 to 255. All lights are off for BREAK_US
// in between. A light that is on already at this level is not touched. True if something changed.
bool show_light(uint8_t light, uint8_t level);
uint8_t light_on();

// Closes the trigger for `duration_ms`.
void trigger_start(uint16_t duration_ms);
bool trigger_active();
// Opens the trigger when its time is over. To be called often.
void trigger_expire();

// Lights and trigger off.
void all_off();

// One bit per output, as the input registers read, not as the outputs were set. A light on at a lower level counts as it
// read in the on phase of its last pulse.
uint32_t pins_read();
