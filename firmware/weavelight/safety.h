// What turns the light off without being asked: a silent host, a light on for too long, a program that hangs.
#pragma once

#include <stdint.h>

// Why the board started, as PROTOCOL.md names it. UNKNOWN where a bootloader has cleared the processor's record.
const char *reset_cause();

void watchdog_begin();

// Watches time: to be called often, from every loop that waits. Returns why the lights were turned off just now, else NULL.
const char *guard();

// A valid line came from the host.
void host_spoke();
// A light was switched on just now.
void light_switched_on();
// A light reached its maximum on-time a moment ago, and lights have to stay off for now.
bool resting();
