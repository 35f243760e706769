/* A simulated Arduino Uno with the firmware in it: processor, pins with the time of every edge, and a serial wire that
 * can be made bad. Time is the board's own, in clock cycles since power-on; it never depends on the wall clock.
 *
 * Uses libsimavr (GPL 3). This is a test program of its own; nothing of Weavelight is linked with it. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define CLOCK_HZ 16000000ULL

typedef struct {
    double drop;      /* probability that a byte vanishes */
    double flip;      /* that it arrives changed */
    double delay;     /* that it and all behind it come late */
    double delay_ms;
} wire_faults_t;

typedef enum { TO_BOARD, FROM_BOARD } direction_t;

typedef struct {
    uint64_t us;
    uint32_t pins;
} edge_t;

typedef enum { POWER_ON, RESET_BUTTON } reset_t;

/* Loads the firmware (ELF) and, unless NULL, a bootloader (Intel hex) that then starts first. */
bool board_begin(const char *firmware, const char *bootloader);
void board_reset(reset_t cause);
/* After a reset the processor waits for so long, and what arrives meanwhile is lost. */
void board_set_boot_delay(double ms);

/* Lets `us` microseconds pass on the board; with `until_line`, at most to the end of the first line it sends. */
void board_run(uint64_t us, bool until_line);
uint64_t board_us(void);

/* Bit n is output n of the firmware: the pin is driven high. */
uint32_t board_pins(void);
/* Edges since the last call; valid until the next board_run. */
const edge_t *board_take_edges(size_t *count);

/* The program loops for ever with interrupts off, as after a fault in memory; the watchdog keeps running. */
void board_hang(void);

void wire_set_faults(direction_t direction, wire_faults_t faults);
void wire_set_seed(uint64_t seed);
/* A cut cable: nothing arrives either way. */
void wire_set_mute(bool mute);
void wire_send(const uint8_t *bytes, size_t count);
/* What arrived at the host since the last call; valid until the next board_run. */
const uint8_t *wire_take(size_t *count);
