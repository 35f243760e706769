#include "protocol.h"

#include <string.h>

const char *error_name(Error error) {
    switch (error) {
    case ERROR_SYNTAX: return "SYNTAX";
    case ERROR_CHECKSUM: return "CHECKSUM";
    case ERROR_VERB: return "VERB";
    case ERROR_RANGE: return "RANGE";
    case ERROR_TOOLONG: return "TOOLONG";
    case ERROR_INTERLOCK: return "INTERLOCK";
    default: return "NONE";
    }
}

uint8_t crc8(const char *bytes, uint8_t count) {
    uint8_t crc = 0;
    for (uint8_t i = 0; i < count; i++) {
        crc ^= (uint8_t)bytes[i];
        for (uint8_t bit = 0; bit < 8; bit++) crc = (crc & 0x80) ? (crc << 1) ^ 0x07 : crc << 1;
    }
    return crc;
}

LineReader::State LineReader::take(char byte) {
    if (byte != '\n' && byte != '\r') {
        if (length_ == LINE_MAX) overflow_ = true;
        else text_[length_++] = byte;
        return PARTIAL;
    }
    State state = overflow_ ? TOO_LONG : length_ == 0 ? PARTIAL : WHOLE;
    text_[length_] = '\0';
    length_ = 0;
    overflow_ = false;
    return state;
}

static char hex_digit(uint8_t value) {
    return value < 10 ? '0' + value : 'A' + (value - 10);
}

// Removes "*HH" from the end of `line` if it is there.
static Error take_checksum(char *line, bool &checksummed) {
    char *star = strchr(line, '*');
    checksummed = star != NULL;
    if (!checksummed) return ERROR_NONE;
    uint8_t crc = crc8(line, star - line);
    bool right = star[1] == hex_digit(crc >> 4) && star[2] == hex_digit(crc & 15) && star[3] == '\0';
    *star = '\0';
    return right ? ERROR_NONE : ERROR_CHECKSUM;
}

// The word at `cursor`, which moves behind it; NULL where there is none. Words are separated by exactly one space.
static char *take_word(char *&cursor) {
    if (cursor == NULL || *cursor == '\0' || *cursor == ' ') return NULL;
    char *word = cursor;
    cursor = strchr(cursor, ' ');
    if (cursor != NULL) *cursor++ = '\0';
    return word;
}

static bool parse_seq(const char *text, uint16_t &seq) {
    uint32_t value = 0;
    uint8_t digits = 0;
    for (; text[digits] >= '0' && text[digits] <= '9' && digits < 6; digits++) value = 10 * value + (text[digits] - '0');
    if (digits == 0 || text[digits] != '\0' || value > 65535) return false;
    seq = value;
    return true;
}

Error parse_request(char *line, Request &request) {
    request.seq_known = false;
    request.argument_count = 0;
    Error error = take_checksum(line, request.checksummed);
    if (error != ERROR_NONE) return error;

    char *cursor = line;
    const char *seq = take_word(cursor);
    if (seq == NULL || !parse_seq(seq, request.seq)) return ERROR_SYNTAX;
    request.seq_known = true;
    request.verb = take_word(cursor);
    if (request.verb == NULL) return ERROR_SYNTAX;
    while (cursor != NULL) {
        const char *argument = take_word(cursor);
        if (argument == NULL || request.argument_count == ARGUMENTS_MAX) return ERROR_SYNTAX;
        request.arguments[request.argument_count++] = argument;
    }
    return ERROR_NONE;
}

bool parse_number(const char *text, uint8_t width, uint16_t &value) {
    uint32_t sum = 0;
    for (uint8_t i = 0; i < width; i++) {
        if (text[i] < '0' || text[i] > '9') return false;
        sum = 10 * sum + (text[i] - '0');
    }
    value = sum;
    return text[width] == '\0' && sum <= 65535;
}

void Reply::put(char byte) {
    if (length_ < LINE_MAX - 3) text_[length_++] = byte;
}

void Reply::space() {
    if (length_ > 0) put(' ');
}

Reply &Reply::text(const char *text) {
    space();
    while (*text) put(*text++);
    return *this;
}

Reply &Reply::number(uint32_t value) {
    return number(value, 1);
}

Reply &Reply::number(uint32_t value, uint8_t digits) {
    char text[10];
    uint8_t count = 0;
    do text[count++] = '0' + value % 10;
    while ((value /= 10) || count < digits);
    space();
    while (count) put(text[--count]);
    return *this;
}

Reply &Reply::hex(uint32_t value, uint8_t digits) {
    space();
    while (digits--) put(hex_digit((value >> (4 * digits)) & 15));
    return *this;
}

const char *Reply::finish() {
    uint8_t crc = crc8(text_, length_);
    text_[length_++] = '*';
    text_[length_++] = hex_digit(crc >> 4);
    text_[length_++] = hex_digit(crc & 15);
    text_[length_++] = '\n';
    text_[length_] = '\0';
    return text_;
}
