#include "settings.h"

#include <avr/eeprom.h>
#include <string.h>
#include "protocol.h"

static const SettingName NAMES[] = {
    {"SETTLE", &Settings::settle_ms, 0, 30, 2},
    {"MAXON", &Settings::max_on_ms, 100, 65000, 60000},
    {"REST", &Settings::rest_ms, 0, 65000, 2000},
};

struct Stored {
    uint8_t version;
    Settings settings;
    uint8_t crc;
};

static Stored *const STORED = 0;
static Settings current;

static uint8_t crc_of(const Stored &stored) {
    return crc8((const char *)&stored, offsetof(Stored, crc));
}

static bool within_limits(const Settings &settings) {
    for (const SettingName &name : NAMES) {
        uint16_t value = settings.*(name.field);
        if (value < name.least || value > name.most) return false;
    }
    return true;
}

void settings_begin() {
    Stored stored;
    eeprom_read_block(&stored, STORED, sizeof stored);
    current = stored.settings;
    if (stored.version == SETTINGS_VERSION && stored.crc == crc_of(stored) && within_limits(current)) return;
    for (const SettingName &name : NAMES) current.*(name.field) = name.standard;
}

const Settings &settings() {
    return current;
}

const SettingName *setting_named(const char *name) {
    for (const SettingName &known : NAMES) {
        if (strcmp(known.name, name) == 0) return &known;
    }
    return NULL;
}

void settings_change(const SettingName &setting, uint16_t value) {
    current.*(setting.field) = value;
    Stored stored;
    stored.version = SETTINGS_VERSION;
    stored.settings = current;
    stored.crc = crc_of(stored);
    eeprom_update_block(&stored, STORED, sizeof stored);
}
