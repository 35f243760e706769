#include "commands.h"

#include <Arduino.h>
#include <string.h>
#include "config.h"
#include "outputs.h"
#include "safety.h"
#include "settings.h"

static const uint8_t LIGHT_DIGITS = 2;
static const uint8_t LEVEL_DIGITS = 3;
static const uint8_t NUMBER_DIGITS = 5;
static const uint16_t TRIGGER_MOST_MS = 5000;

// A damaged line must never pass as one that a person typed without a checksum: after the first checksummed line, only
// checksummed ones count, until the next reset.
static bool only_checksummed = false;

// The last request that was carried out: the same number again is a retry.
static uint16_t last_seq;
static bool last_seq_known = false;

static void send(Reply &reply) {
    Serial.write(reply.finish());
}

static void send_event(const char *event, const char *cause) {
    Reply reply;
    send(reply.text("!").text(event).text(cause));
}

void send_boot() {
    // Ends a line that the restart cut off.
    Serial.write('\n');
    send_event("BOOT", reset_cause());
}

void guard_and_tell() {
    const char *reason = guard();
    if (reason != NULL) send_event("SAFE", reason);
}

static void report_outputs(Reply &reply) {
    reply.text("OK").hex(pins_read(), 5).number(millis(), 10);
}

static void settle() {
    uint32_t start_ms = millis();
    while (millis() - start_ms < settings().settle_ms) guard_and_tell();
}

// The light's level: the last argument if it is there.
static Error parse_level(const Request &request, uint8_t position, uint8_t &level) {
    level = FULL_LEVEL;
    if (request.argument_count == position) return ERROR_NONE;
    uint16_t value;
    if (!parse_number(request.arguments[position], LEVEL_DIGITS, value)) return ERROR_SYNTAX;
    if (!HAS_LEVELS || value < 1 || value > FULL_LEVEL) return ERROR_RANGE;
    level = value;
    return ERROR_NONE;
}

static Error switch_light(uint8_t light, uint8_t level, Reply &reply) {
    if (resting()) return ERROR_INTERLOCK;
    uint8_t before = light_on();
    if (show_light(light, level)) {
        // Another level of the same light does not start its on-time again.
        if (light != before) light_switched_on();
        settle();
    }
    report_outputs(reply);
    return ERROR_NONE;
}

static Error run_light(const Request &request, Reply &reply) {
    uint16_t light;
    if (request.argument_count < 1 || !parse_number(request.arguments[0], LIGHT_DIGITS, light)) return ERROR_SYNTAX;
    if (light >= LIGHT_COUNT) return ERROR_RANGE;
    uint8_t level;
    Error error = parse_level(request, 1, level);
    return error == ERROR_NONE ? switch_light(light, level, reply) : error;
}

static Error run_back(const Request &request, Reply &reply) {
    if (!HAS_BACK_LIGHT) return ERROR_VERB;
    if (request.argument_count > 1) return ERROR_SYNTAX;
    uint8_t level;
    Error error = parse_level(request, 0, level);
    return error == ERROR_NONE ? switch_light(BACK_LIGHT, level, reply) : error;
}

static Error run_off(const Request &request, Reply &reply) {
    if (request.argument_count != 0) return ERROR_SYNTAX;
    all_off();
    report_outputs(reply);
    return ERROR_NONE;
}

static Error run_ping(const Request &request, Reply &reply) {
    if (request.argument_count != 0) return ERROR_SYNTAX;
    report_outputs(reply);
    return ERROR_NONE;
}

static Error run_trigger(const Request &request, Reply &reply) {
    if (!HAS_TRIGGER) return ERROR_VERB;
    uint16_t duration_ms;
    if (request.argument_count != 1 || !parse_number(request.arguments[0], NUMBER_DIGITS, duration_ms)) return ERROR_SYNTAX;
    if (duration_ms < 1 || duration_ms > TRIGGER_MOST_MS) return ERROR_RANGE;
    // A pulse cannot be taken back, so a retry must not start another.
    bool retry = last_seq_known && request.seq == last_seq;
    if (!retry) {
        if (trigger_active()) return ERROR_INTERLOCK;
        trigger_start(duration_ms);
    }
    report_outputs(reply);
    return ERROR_NONE;
}

static Error run_get(const Request &request, Reply &reply) {
    if (request.argument_count != 1) return ERROR_SYNTAX;
    const SettingName *setting = setting_named(request.arguments[0]);
    if (setting == NULL) return ERROR_RANGE;
    reply.text("OK").number(settings().*(setting->field));
    return ERROR_NONE;
}

static Error run_set(const Request &request, Reply &reply) {
    uint16_t value;
    if (request.argument_count != 2 || !parse_number(request.arguments[1], NUMBER_DIGITS, value)) return ERROR_SYNTAX;
    const SettingName *setting = setting_named(request.arguments[0]);
    if (setting == NULL || value < setting->least || value > setting->most) return ERROR_RANGE;
    settings_change(*setting, value);
    reply.text("OK").number(value);
    return ERROR_NONE;
}

static const char *features() {
    static char text[4];
    uint8_t count = 0;
    if (HAS_LEVELS) text[count++] = 'L';
    if (HAS_BACK_LIGHT) text[count++] = 'B';
    if (HAS_TRIGGER) text[count++] = 'T';
    if (count == 0) text[count++] = '-';
    text[count] = '\0';
    return text;
}

static Error run_id(const Request &request, Reply &reply) {
    if (request.argument_count != 0) return ERROR_SYNTAX;
    reply.text("OK").text(BOARD_NAME).text(FIRMWARE_VERSION).number(PROTOCOL_VERSION).number(LIGHT_COUNT).text(features());
    return ERROR_NONE;
}

struct Verb {
    const char *name;
    Error (*run)(const Request &, Reply &);
};

static const Verb VERBS[] = {
    {"ID?", run_id},       {"LIGHT", run_light}, {"OFF", run_off}, {"BACK", run_back},
    {"TRIG", run_trigger}, {"PING", run_ping},   {"GET", run_get}, {"SET", run_set},
};

static Error run(const Request &request, Reply &reply) {
    for (const Verb &verb : VERBS) {
        if (strcmp(verb.name, request.verb) == 0) return verb.run(request, reply);
    }
    return ERROR_VERB;
}

static void send_error(const Request &request, Error error) {
    Reply reply;
    if (request.seq_known) reply.number(request.seq);
    else reply.text("?");
    send(reply.text("ERR").number(error).text(error_name(error)));
}

static Error check_checksum(const Request &request) {
    if (request.checksummed) only_checksummed = true;
    return only_checksummed && !request.checksummed ? ERROR_CHECKSUM : ERROR_NONE;
}

void answer_line(char *line) {
    Request request;
    Error error = parse_request(line, request);
    if (error == ERROR_NONE) error = check_checksum(request);
    // The number of a line that may be damaged is not to be trusted.
    if (error == ERROR_CHECKSUM || !request.checksummed && error == ERROR_SYNTAX) request.seq_known = false;
    if (error != ERROR_NONE) return send_error(request, error);

    host_spoke();
    Reply reply;
    reply.number(request.seq);
    error = run(request, reply);
    if (error != ERROR_NONE) return send_error(request, error);
    last_seq = request.seq;
    last_seq_known = true;
    send(reply);
}

void answer_too_long() {
    Request request;
    request.seq_known = false;
    send_error(request, ERROR_TOOLONG);
}
