// The wire: lines, checksums, requests and replies, as PROTOCOL.md describes them. No Arduino in here.
#pragma once

#include <stddef.h>
#include <stdint.h>

// The longest line in either direction, checksum included, line end not.
const uint8_t LINE_MAX = 48;

// The numbers are part of the protocol; PROTOCOL.md and the host have the same list.
enum Error : uint8_t {
    ERROR_NONE = 0,
    ERROR_SYNTAX = 1,
    ERROR_CHECKSUM = 2,
    ERROR_VERB = 3,
    ERROR_RANGE = 4,
    ERROR_TOOLONG = 5,
    ERROR_INTERLOCK = 6,
};

const char *error_name(Error error);

// CRC-8: polynomial x^8 + x^2 + x + 1 (0x07), start 0, not reflected. It finds every error of up to three bits in 14 bytes.
uint8_t crc8(const char *bytes, uint8_t count);

// Collects bytes up to a line end (LF, CR or both). Empty lines do not count.
class LineReader {
public:
    enum State : uint8_t { PARTIAL, WHOLE, TOO_LONG };
    State take(char byte);
    // The line without its end, valid until the next take().
    char *text() { return text_; }

private:
    char text_[LINE_MAX + 1];
    uint8_t length_ = 0;
    bool overflow_ = false;
};

const uint8_t ARGUMENTS_MAX = 2;

struct Request {
    uint16_t seq;
    bool seq_known;
    bool checksummed;
    const char *verb;
    uint8_t argument_count;
    const char *arguments[ARGUMENTS_MAX];
};

// Cuts `line` into its parts, in place. The request points into it.
Error parse_request(char *line, Request &request);

// Reads exactly `width` decimal digits. A lost digit is therefore an error and never another number.
bool parse_number(const char *text, uint8_t width, uint16_t &value);

// A line to send: words with single spaces between them.
class Reply {
public:
    Reply &text(const char *text);
    Reply &number(uint32_t value);
    Reply &number(uint32_t value, uint8_t digits);
    Reply &hex(uint32_t value, uint8_t digits);
    // Adds checksum and line end.
    const char *finish();

private:
    void put(char byte);
    void space();
    // Room for the checksum and the line end is kept free.
    char text_[LINE_MAX + 2];
    uint8_t length_ = 0;
};
