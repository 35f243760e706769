// Build options. What the wiring decides is in pins.h; what can change while the board runs is in settings.h.
#pragma once

// How many LEDs are connected: 1 to 16. The host compares it with rig.toml.
#ifndef LIGHT_COUNT
#define LIGHT_COUNT 10
#endif

// LIGHT and BACK take a level of 1 to 255 (pulse width, 976 Hz). Exposures should then last 0.1 s or more.
#ifndef HAS_LEVELS
#define HAS_LEVELS 1
#endif

// An output for a light behind the fabric (lace).
#ifndef HAS_BACK_LIGHT
#define HAS_BACK_LIGHT 1
#endif

// An output for a camera's remote socket, through an optocoupler.
#ifndef HAS_TRIGGER
#define HAS_TRIGGER 1
#endif

// Resets a program that hangs. Set it to 0 on a board with the old bootloader (Duemilanove, many Nano clones): there a
// watchdog reset starts the bootloader with the watchdog still on, and the board resets for ever.
#ifndef USE_WATCHDOG
#define USE_WATCHDOG 1
#endif

// Every light goes dark when the host has said nothing valid for so long.
#define HOST_SILENCE_MS 500

// Pause between the old light and the new: longer than a driver takes to switch off.
#define BREAK_US 50

#define BAUD 115200

#define BOARD_NAME "WEAVELIGHT"
#define FIRMWARE_VERSION "1.0.0"
#define PROTOCOL_VERSION 1
