#include "safety.h"

#include <Arduino.h>
#include <avr/wdt.h>
#include "config.h"
#include "outputs.h"
#include "settings.h"

// After a watchdog reset the watchdog still runs, at its shortest time: it has to go off before main().
static uint8_t reset_flags __attribute__((section(".noinit")));
void take_reset_flags(void) __attribute__((naked, used, section(".init3")));
void take_reset_flags(void) {
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

const char *reset_cause() {
    if (reset_flags & _BV(WDRF)) return "WATCHDOG";
    if (reset_flags & _BV(BORF)) return "BROWNOUT";
    if (reset_flags & _BV(EXTRF)) return "RESET";
    if (reset_flags & _BV(PORF)) return "POWER";
    return "UNKNOWN";
}

static uint32_t spoke_ms;
static uint32_t on_ms;
static uint32_t rest_ms;
static bool rests = false;

void watchdog_begin() {
    if (USE_WATCHDOG) wdt_enable(WDTO_250MS);
}

void host_spoke() {
    spoke_ms = millis();
}

void light_switched_on() {
    on_ms = millis();
}

bool resting() {
    if (rests && millis() - rest_ms >= settings().rest_ms) rests = false;
    return rests;
}

static void start_rest() {
    rest_ms = millis();
    rests = true;
}

const char *guard() {
    if (USE_WATCHDOG) wdt_reset();
    trigger_expire();
    uint32_t now_ms = millis();
    if (light_on() != NO_LIGHT && now_ms - on_ms >= settings().max_on_ms) {
        all_off();
        start_rest();
        return "MAXON";
    }
    bool active = light_on() != NO_LIGHT || trigger_active();
    if (active && now_ms - spoke_ms >= HOST_SILENCE_MS) {
        all_off();
        return "SILENCE";
    }
    return NULL;
}
