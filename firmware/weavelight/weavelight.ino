// Weavelight light board for an Arduino Uno: one LED at a time, and never one that nobody watches.
// README.md beside this folder has the wiring and the safety notes, PROTOCOL.md the protocol.

#include <avr/sleep.h>

#include "commands.h"
#include "config.h"
#include "outputs.h"
#include "protocol.h"
#include "safety.h"
#include "settings.h"

static LineReader reader;

void setup() {
    outputs_begin();
    settings_begin();
    Serial.begin(BAUD);
    watchdog_begin();
    send_boot();
}

static void take_byte(char byte) {
    switch (reader.take(byte)) {
    case LineReader::WHOLE: answer_line(reader.text()); break;
    case LineReader::TOO_LONG: answer_too_long(); break;
    case LineReader::PARTIAL: break;
    }
}

void loop() {
    guard_and_tell();
    while (Serial.available()) {
        take_byte(Serial.read());
        guard_and_tell();
    }
    // The next byte or the millisecond timer wakes the processor.
    set_sleep_mode(SLEEP_MODE_IDLE);
    sleep_mode();
}
