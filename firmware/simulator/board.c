#include "board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_hex.h>

/* Ten bits at 115200 baud. */
#define BYTE_CYCLES (CLOCK_HZ * 10 / 115200)
#define US_CYCLES (CLOCK_HZ / 1000000)
#define EICRA 0x69
#define QUEUE_SIZE 65536
#define EDGES_MAX 4000000

typedef struct {
    uint8_t byte;
    uint64_t due;
} queued_t;

typedef struct {
    queued_t items[QUEUE_SIZE];
    size_t head, tail;
    uint64_t last_due;
    wire_faults_t faults;
} wire_t;

static avr_t *avr;
static uint64_t cycles;      /* since power-on, across resets */
static uint64_t avr_cycles;  /* the processor's own count when `cycles` was last brought up to date */
static uint64_t held_until;  /* the boot delay's end */
static uint64_t boot_delay;
static bool was_reset;
static void (*core_reset)(avr_t *);

static avr_irq_t *uart_input;
static wire_t wires[2];
static bool muted;
static uint64_t random_state = 0x9E3779B97F4A7C15ULL;
static uint8_t arrived[QUEUE_SIZE];
static size_t arrived_count;
static bool line_arrived;

static uint32_t pins;
static edge_t *edges;
static size_t edge_count, edge_room;

static uint8_t hung_flash[2];
static int32_t hung_at = -1;

/* The firmware's pins.h: output number to port and bit. */
static const struct { char port; uint8_t bit; } OUTPUTS[18] = {
    {'D', 2}, {'D', 3}, {'D', 4}, {'D', 5}, {'D', 6}, {'D', 7}, {'B', 0}, {'B', 1}, {'B', 2}, {'B', 3},
    {'C', 1}, {'C', 2}, {'C', 3}, {'C', 4}, {'C', 5}, {0, 0}, {'B', 4}, {'C', 0},
};

/* xorshift64*: Vigna, "An experimental exploration of Marsaglia's xorshift generators, scrambled", 2016. */
static uint64_t next_random(void) {
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return random_state * 0x2545F4914F6CDD1DULL;
}

static bool happens(double probability) {
    return probability > 0 && (next_random() >> 11) * 0x1.0p-53 < probability;
}

void wire_set_seed(uint64_t seed) {
    random_state = seed * 2 + 1;
}

void wire_set_faults(direction_t direction, wire_faults_t faults) {
    wires[direction].faults = faults;
}

void wire_set_mute(bool mute) {
    muted = mute;
}

static void wire_put(direction_t direction, uint8_t byte, uint64_t start) {
    wire_t *wire = &wires[direction];
    if (muted || happens(wire->faults.drop)) return;
    if (happens(wire->faults.flip)) byte ^= 1 + next_random() % 255;
    uint64_t due = start + BYTE_CYCLES;
    if (happens(wire->faults.delay)) due += (uint64_t)(wire->faults.delay_ms * 1000) * US_CYCLES;
    if (due < wire->last_due + BYTE_CYCLES) due = wire->last_due + BYTE_CYCLES;
    size_t next = (wire->tail + 1) % QUEUE_SIZE;
    if (next == wire->head) return;
    wire->last_due = due;
    wire->items[wire->tail] = (queued_t){byte, due};
    wire->tail = next;
}

static bool wire_get(direction_t direction, uint8_t *byte) {
    wire_t *wire = &wires[direction];
    if (wire->head == wire->tail || wire->items[wire->head].due > cycles) return false;
    *byte = wire->items[wire->head].byte;
    wire->head = (wire->head + 1) % QUEUE_SIZE;
    return true;
}

void wire_send(const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) wire_put(TO_BOARD, bytes[i], cycles);
}

const uint8_t *wire_take(size_t *count) {
    *count = arrived_count;
    arrived_count = 0;
    return arrived;
}

static void move_bytes(void) {
    uint8_t byte;
    if (wire_get(TO_BOARD, &byte) && cycles >= held_until) avr_raise_irq(uart_input, byte);
    while (arrived_count < QUEUE_SIZE && wire_get(FROM_BOARD, &byte)) {
        arrived[arrived_count++] = byte;
        line_arrived |= byte == '\n';
    }
}

static void count_cycles(void) {
    /* The processor's count starts again with a reset. */
    cycles += avr->cycle >= avr_cycles ? avr->cycle - avr_cycles : avr->cycle;
    avr_cycles = avr->cycle;
}

static void on_uart_output(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    count_cycles();
    wire_put(FROM_BOARD, value, cycles);
}

static uint32_t driven_high(void) {
    uint32_t high = 0;
    for (int i = 0; i < 18; i++) {
        /* The registers PIN, DDR and PORT of B start at 0x23, of C at 0x26, of D at 0x29. */
        if (OUTPUTS[i].port == 0) continue;
        const uint8_t *registers = avr->data + 0x23 + 3 * (OUTPUTS[i].port - 'B');
        if (registers[1] & registers[2] & (1 << OUTPUTS[i].bit)) high |= 1u << i;
    }
    return high;
}

static void note_pins(void) {
    uint32_t now = driven_high();
    if (now == pins) return;
    pins = now;
    if (edge_count == edge_room && edge_room < EDGES_MAX) {
        edge_room = edge_room ? 2 * edge_room : 1024;
        edges = realloc(edges, edge_room * sizeof *edges);
        if (!edges) abort();
    }
    if (edge_count < edge_room) edges[edge_count++] = (edge_t){board_us(), now};
}

static void on_port(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value, (void)param;
    count_cycles();
    note_pins();
}

static void on_reset(avr_t *resetting) {
    if (core_reset) core_reset(resetting);
    was_reset = true;
}

static void do_not_sleep(avr_t *sleeping, avr_cycle_count_t how_long) {
    (void)sleeping, (void)how_long;
}

static bool load_bootloader(const char *path) {
    ihex_chunk_p chunks = NULL;
    int count = read_ihex_chunks(path, &chunks);
    if (count <= 0) return false;
    for (int i = 0; i < count; i++) memcpy(avr->flash + chunks[i].baseaddr, chunks[i].data, chunks[i].size);
    avr->reset_pc = chunks[0].baseaddr;
    avr->codeend = avr->flashend;
    free_ihex_chunks(chunks);
    return true;
}

static void connect_pins(void) {
    for (char port = 'B'; port <= 'D'; port++) {
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), IOPORT_IRQ_REG_PORT), on_port, NULL);
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), IOPORT_IRQ_DIRECTION_ALL), on_port, NULL);
    }
}

static void connect_uart(void) {
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_uart_output, NULL);
}

bool board_begin(const char *firmware, const char *bootloader) {
    elf_firmware_t elf = {0};
    if (elf_read_firmware(firmware, &elf) != 0) return false;
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr || avr_init(avr) != 0) return false;
    elf.frequency = CLOCK_HZ;
    avr_load_firmware(avr, &elf);
    avr->frequency = CLOCK_HZ;
    avr->log = LOG_NONE;
    avr->sleep = do_not_sleep;
    core_reset = avr->reset;
    avr->reset = on_reset;
    if (bootloader && !load_bootloader(bootloader)) return false;
    connect_pins();
    connect_uart();
    board_reset(POWER_ON);
    return true;
}

void board_set_boot_delay(double ms) {
    boot_delay = (uint64_t)(ms * 1000) * US_CYCLES;
}

/* A reset is a reset, whoever asked for it: the watchdog in the processor, or board_reset. */
static void after_reset(void) {
    was_reset = false;
    /* D2 and D3, outputs here, as edge-triggered: else libsimavr looks at their level in every cycle, asleep or not. */
    avr->data[EICRA] = 0x0F;
    if (hung_at >= 0) memcpy(avr->flash + hung_at, hung_flash, 2);
    hung_at = -1;
    held_until = cycles + boot_delay;
    note_pins();
}

void board_reset(reset_t cause) {
    count_cycles();
    avr_reset(avr);
    avr_regbit_clear(avr, avr->reset_flags.porf);
    avr_regbit_clear(avr, avr->reset_flags.wdrf);
    avr_regbit_set(avr, cause == POWER_ON ? avr->reset_flags.porf : avr->reset_flags.extrf);
    avr_cycles = avr->cycle;
    after_reset();
}

static void step(uint64_t end) {
    move_bytes();
    if (cycles < held_until) {
        uint64_t next = cycles + BYTE_CYCLES / 4;
        cycles = next < held_until ? next : held_until;
        return;
    }
    uint64_t left = end - cycles;
    avr->run_cycle_limit = left < 200 ? left + 1 : 200;
    avr_run(avr);
    if (was_reset) {
        avr_cycles = avr->cycle;
        after_reset();
    }
    count_cycles();
}

void board_run(uint64_t us, bool until_line) {
    uint64_t end = cycles + us * US_CYCLES;
    line_arrived = false;
    while (cycles < end && !(until_line && line_arrived)) step(end);
    move_bytes();
}

uint64_t board_us(void) {
    return cycles / US_CYCLES;
}

uint32_t board_pins(void) {
    return pins;
}

const edge_t *board_take_edges(size_t *count) {
    *count = edge_count;
    edge_count = 0;
    return edges;
}

void board_hang(void) {
    if (hung_at >= 0) return;
    hung_at = avr->pc;
    memcpy(hung_flash, avr->flash + hung_at, 2);
    /* rjmp to itself */
    avr->flash[hung_at] = 0xFF;
    avr->flash[hung_at + 1] = 0xCF;
    avr->sreg[S_I] = 0;
    avr->state = cpu_Running;
}
