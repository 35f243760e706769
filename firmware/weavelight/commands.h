// The verbs: what each line asks for, and what is answered.
#pragma once

#include "protocol.h"

// The board's first line after a start.
void send_boot();
// Guards the lights, and tells the host if they had to go off.
void guard_and_tell();
// Answers one line.
void answer_line(char *line);
void answer_too_long();
