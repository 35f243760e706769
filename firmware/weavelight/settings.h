// What can be changed while the board runs, and survives power-off. Raise SETTINGS_VERSION when the fields change:
// the board then starts with the defaults.
#pragma once

#include <stdint.h>

const uint8_t SETTINGS_VERSION = 1;

struct Settings {
    // From a light's switching on to its acknowledgement.
    uint16_t settle_ms;
    // The longest that one light may stay on.
    uint16_t max_on_ms;
    // How long lights stay off after one reached max_on_ms.
    uint16_t rest_ms;
};

// Reads the EEPROM; the defaults where it holds none of this version.
void settings_begin();
const Settings &settings();

struct SettingName {
    const char *name;
    uint16_t Settings::*field;
    uint16_t least;
    uint16_t most;
    uint16_t standard;
};

// NULL where there is no setting of that name.
const SettingName *setting_named(const char *name);
// The value must be within the setting's limits. Written to EEPROM only if it differs.
void settings_change(const SettingName &setting, uint16_t value);
