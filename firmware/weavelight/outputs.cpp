#include "outputs.h"

#include <Arduino.h>
#include <util/atomic.h>
#include "pins.h"

struct Pin {
    volatile uint8_t *output;
    volatile uint8_t *input;
    uint8_t mask;
};

static Pin light_pins[LIGHT_COUNT];
static Pin back_light_pin;
static Pin trigger_pin;

static uint8_t shown = NO_LIGHT;
static uint8_t shown_level = 0;
static uint32_t trigger_start_ms;
static uint16_t trigger_duration_ms;
static bool trigger_closed = false;

// What the pulse interrupts drive; they run only while a level below full is shown.
static Pin pulsed;
static volatile bool pulse_read_high;

static void set_high(const Pin &pin) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *pin.output |= pin.mask; }
}

static void set_low(const Pin &pin) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *pin.output &= ~pin.mask; }
}

static bool reads_high(const Pin &pin) {
    return *pin.input & pin.mask;
}

static Pin claim(uint8_t number) {
    Pin pin = {portOutputRegister(digitalPinToPort(number)), portInputRegister(digitalPinToPort(number)),
               digitalPinToBitMask(number)};
    set_low(pin);
    pinMode(number, OUTPUT);
    return pin;
}

void outputs_begin() {
    for (uint8_t i = 0; i < LIGHT_COUNT; i++) light_pins[i] = claim(LIGHT_PINS[i]);
    if (HAS_BACK_LIGHT) back_light_pin = claim(BACK_LIGHT_PIN);
    if (HAS_TRIGGER) trigger_pin = claim(TRIGGER_PIN);
}

static const Pin &pin_of(uint8_t light) {
    return light == BACK_LIGHT ? back_light_pin : light_pins[light];
}

#if HAS_LEVELS
// Timer 2 counts to 255 at 4 us a step. Its own pins stay unconnected: the interrupts can drive any pin.
static void pulses_start(const Pin &pin, uint8_t level) {
    pulsed = pin;
    pulse_read_high = true;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        TCCR2A = 0;
        TCCR2B = _BV(CS22);
        TCNT2 = 0;
        OCR2A = level;
        TIFR2 = _BV(OCF2A) | _BV(TOV2);
        TIMSK2 = _BV(OCIE2A) | _BV(TOIE2);
    }
}

static void pulses_stop() {
    TIMSK2 = 0;
}

ISR(TIMER2_OVF_vect) {
    *pulsed.output |= pulsed.mask;
    _NOP(); // the input register follows a clock later
    pulse_read_high = *pulsed.input & pulsed.mask;
}

ISR(TIMER2_COMPA_vect) {
    *pulsed.output &= ~pulsed.mask;
}
#else
static void pulses_start(const Pin &, uint8_t) {}
static void pulses_stop() {}
#endif

static void lights_off() {
    pulses_stop();
    for (const Pin &pin : light_pins) set_low(pin);
    if (HAS_BACK_LIGHT) set_low(back_light_pin);
    shown = NO_LIGHT;
}

bool show_light(uint8_t light, uint8_t level) {
    if (light == shown && (light == NO_LIGHT || level == shown_level)) return false;
    bool was_on = shown != NO_LIGHT;
    lights_off();
    if (light == NO_LIGHT) return true;
    if (was_on) delayMicroseconds(BREAK_US);
    set_high(pin_of(light));
    shown = light;
    shown_level = level;
    if (level != FULL_LEVEL) pulses_start(pin_of(light), level);
    return true;
}

uint8_t light_on() {
    return shown;
}

void trigger_start(uint16_t duration_ms) {
    trigger_start_ms = millis();
    trigger_duration_ms = duration_ms;
    trigger_closed = true;
    set_high(trigger_pin);
}

bool trigger_active() {
    return trigger_closed;
}

static void trigger_open() {
    if (HAS_TRIGGER) set_low(trigger_pin);
    trigger_closed = false;
}

void trigger_expire() {
    if (trigger_closed && millis() - trigger_start_ms >= trigger_duration_ms) trigger_open();
}

void all_off() {
    lights_off();
    trigger_open();
}

static bool light_reads_high(uint8_t light) {
    bool pulsing = light == shown && shown_level != FULL_LEVEL;
    return pulsing ? pulse_read_high : reads_high(pin_of(light));
}

uint32_t pins_read() {
    uint32_t pins = 0;
    for (uint8_t i = 0; i < LIGHT_COUNT; i++) {
        if (light_reads_high(i)) pins |= 1UL << i;
    }
    if (HAS_BACK_LIGHT && light_reads_high(BACK_LIGHT)) pins |= 1UL << BACK_LIGHT;
    if (HAS_TRIGGER && reads_high(trigger_pin)) pins |= 1UL << TRIGGER;
    return pins;
}
