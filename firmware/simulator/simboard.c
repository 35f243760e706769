/* The simulated board as a program.
 *
 *   simboard --firmware weavelight.elf --link PATH --control SOCKET [--bootloader optiboot.hex]
 *   simboard --firmware weavelight.elf --control SOCKET --stepped
 *
 * In the first form the board's serial port is a pseudo-terminal, which PATH points to, and the board runs at most as fast
 * as the wall clock. In the second, time passes only when `run` or `line` says so. It ends when its standard input does.
 *
 * Control: one command a line on a Unix socket, one line (for `edges` several) in reply.
 *   pins                      "TIME_US PINS", PINS in hexadecimal, bit n = output n
 *   edges                     count, then "TIME_US PINS" for each change since the last call
 *   drop P | flip P | delay P MS [in|out]   what happens to each byte, towards the board (in), from it (out), or both
 *   seed N                    of those accidents
 *   mute 0|1                  a cut cable
 *   hang                      the program loops with interrupts off
 *   reset                     the reset button
 *   freeze MS                 everything stands still (first form)
 *   unplug MS                 the serial port goes away and comes back (first form)
 *   reset-on-open 0|1         as a real Uno does (first form; on at the start)
 *   boot-delay MS             after each reset
 *   send HEX                  bytes to the board (second form)
 *   run US | line US          lets time pass, `line` at most to the end of a line: "TIME_US PINS HEX" with what arrived
 *   quit */
#define _GNU_SOURCE
#include "board.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define SLICE_US 500
/* More behind the wall clock than this, and the board's time is late for good instead of hurrying. */
#define LATE_US 20000
#define CLIENTS 8

static struct { const char *firmware, *bootloader, *link, *control; bool stepped; } options;
static struct { FILE *in, *out; } clients[CLIENTS];
static int control_fd = -1, pty_fd = -1;
static bool quit, port_open, reset_on_open = true;
static uint64_t wall_origin_us, standstill_until_us, plug_in_at_us;

static void fail(const char *what) {
    fprintf(stderr, "simboard: %s: %s\n", what, strerror(errno));
    exit(1);
}

static uint64_t wall_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000ULL + now.tv_nsec / 1000;
}

static void plug_in(void) {
    pty_fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (pty_fd < 0 || grantpt(pty_fd) != 0 || unlockpt(pty_fd) != 0) fail("pseudo-terminal");
    /* Opened and closed once, so that "nobody has it open" can be told from here on. */
    int port = open(ptsname(pty_fd), O_RDWR | O_NOCTTY);
    struct termios raw;
    tcgetattr(port, &raw);
    cfmakeraw(&raw);
    tcsetattr(port, TCSANOW, &raw);
    close(port);
    port_open = false;
    unlink(options.link);
    if (symlink(ptsname(pty_fd), options.link) != 0) fail(options.link);
}

static void unplug(double ms) {
    unlink(options.link);
    close(pty_fd);
    pty_fd = -1;
    plug_in_at_us = wall_us() + (uint64_t)(ms * 1000);
}

/* A pseudo-terminal has no DTR line, but its other end can see whether the port is open. */
static void watch_port(short revents) {
    bool now_open = !(revents & POLLHUP);
    if (now_open && !port_open && reset_on_open) board_reset(RESET_BUTTON);
    port_open = now_open;
}

static void move_port_bytes(void) {
    uint8_t bytes[4096];
    ssize_t count = port_open ? read(pty_fd, bytes, sizeof bytes) : 0;
    if (count > 0) wire_send(bytes, count);
    size_t arrived;
    const uint8_t *from_board = wire_take(&arrived);
    if (port_open && arrived && write(pty_fd, from_board, arrived) < 0 && errno != EAGAIN && errno != EIO) fail("write");
}

static void set_faults(const char *kind, double probability, double ms, const char *way) {
    static wire_faults_t faults[2];
    for (int i = 0; i < 2; i++) {
        if (way && strcmp(way, i == TO_BOARD ? "in" : "out") != 0) continue;
        if (strcmp(kind, "drop") == 0) faults[i].drop = probability;
        if (strcmp(kind, "flip") == 0) faults[i].flip = probability;
        if (strcmp(kind, "delay") == 0) faults[i].delay = probability, faults[i].delay_ms = ms;
        wire_set_faults(i, faults[i]);
    }
}

static void tell_edges(FILE *out) {
    size_t count;
    const edge_t *edges = board_take_edges(&count);
    fprintf(out, "%zu\n", count);
    for (size_t i = 0; i < count; i++) fprintf(out, "%llu %05X\n", (unsigned long long)edges[i].us, edges[i].pins);
}

static void tell_run(FILE *out, double us, bool until_line) {
    board_run(us, until_line);
    size_t count;
    const uint8_t *bytes = wire_take(&count);
    fprintf(out, "%llu %05X ", (unsigned long long)board_us(), board_pins());
    for (size_t i = 0; i < count; i++) fprintf(out, "%02X", bytes[i]);
    fputs(count ? "\n" : "-\n", out);
}

static void send_hex(const char *hex) {
    unsigned byte;
    for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) {
        uint8_t sent = byte;
        wire_send(&sent, 1);
    }
}

/* The commands of the first form; false where `verb` is none of them. */
static bool control_port(const char *verb, double number) {
    if (options.stepped) return false;
    if (strcmp(verb, "freeze") == 0) standstill_until_us = wall_us() + (uint64_t)(number * 1000);
    else if (strcmp(verb, "unplug") == 0) unplug(number);
    else if (strcmp(verb, "reset-on-open") == 0) reset_on_open = number != 0;
    else return false;
    return true;
}

static bool control_board(const char *verb, double number) {
    if (strcmp(verb, "seed") == 0) wire_set_seed((uint64_t)number);
    else if (strcmp(verb, "mute") == 0) wire_set_mute(number != 0);
    else if (strcmp(verb, "hang") == 0) board_hang();
    else if (strcmp(verb, "reset") == 0) board_reset(RESET_BUTTON);
    else if (strcmp(verb, "boot-delay") == 0) board_set_boot_delay(number);
    else if (strcmp(verb, "quit") == 0) quit = true;
    else return false;
    return true;
}

static void control(FILE *out, char *line) {
    char *words[4] = {0};
    int count = 0;
    for (char *word = strtok(line, " \n"); word && count < 4; word = strtok(NULL, " \n")) words[count++] = word;
    if (count == 0) return;
    double number = count > 1 ? atof(words[1]) : 0;
    bool faults = !strcmp(words[0], "drop") || !strcmp(words[0], "flip");
    if (strcmp(words[0], "pins") == 0) fprintf(out, "%llu %05X\n", (unsigned long long)board_us(), board_pins());
    else if (strcmp(words[0], "edges") == 0) tell_edges(out);
    else if (strcmp(words[0], "run") == 0 && options.stepped) tell_run(out, number, false);
    else if (strcmp(words[0], "line") == 0 && options.stepped) tell_run(out, number, true);
    else if (strcmp(words[0], "send") == 0 && options.stepped && count > 1) send_hex(words[1]), fputs("ok\n", out);
    else if (faults) set_faults(words[0], number, 0, words[2]), fputs("ok\n", out);
    else if (strcmp(words[0], "delay") == 0 && count > 2) set_faults("delay", number, atof(words[2]), words[3]), fputs("ok\n", out);
    else if (control_board(words[0], number) || control_port(words[0], number)) fputs("ok\n", out);
    else fprintf(out, "error: %s\n", words[0]);
    fflush(out);
}

static void accept_client(void) {
    int fd = accept4(control_fd, NULL, NULL, SOCK_CLOEXEC);
    for (int i = 0; fd >= 0 && i < CLIENTS; i++) {
        if (clients[i].in) continue;
        clients[i].in = fdopen(fd, "r");
        clients[i].out = fdopen(dup(fd), "w");
        return;
    }
    if (fd >= 0) close(fd);
}

static void serve_client(int i) {
    /* Longer than any run of bytes that a test sends at once, as hexadecimal. */
    char line[65536];
    if (fgets(line, sizeof line, clients[i].in)) return control(clients[i].out, line);
    fclose(clients[i].in);
    fclose(clients[i].out);
    clients[i].in = clients[i].out = NULL;
}

/* Waits at most `timeout_us` for something to happen outside, and deals with it. */
static void look_around(int64_t timeout_us) {
    struct pollfd fds[CLIENTS + 3] = {{0, POLLIN, 0}, {control_fd, POLLIN, 0}, {pty_fd, POLLIN, 0}};
    for (int i = 0; i < CLIENTS; i++) fds[3 + i] = (struct pollfd){clients[i].in ? fileno(clients[i].in) : -1, POLLIN, 0};
    /* A closed port would be reported without end; its state is read once a round all the same. */
    if (!port_open) fds[2].events = 0, fds[2].fd = -1;
    struct timespec timeout = {timeout_us / 1000000, timeout_us % 1000000 * 1000};
    ppoll(fds, CLIENTS + 3, timeout_us < 0 ? NULL : &timeout, NULL);
    char ignored[64];
    if (fds[0].revents && read(0, ignored, sizeof ignored) <= 0) quit = true;
    if (fds[1].revents) accept_client();
    for (int i = 0; i < CLIENTS; i++) {
        if (fds[3 + i].revents) serve_client(i);
    }
}

static void serve_port(void) {
    if (pty_fd < 0) {
        if (wall_us() < plug_in_at_us) return;
        plug_in();
        board_reset(POWER_ON);
    }
    struct pollfd port = {pty_fd, POLLIN, 0};
    poll(&port, 1, 0);
    watch_port(port.revents);
    move_port_bytes();
}

static void run_with_the_wall_clock(void) {
    wall_origin_us = wall_us() - board_us();
    while (!quit) {
        if (wall_us() < standstill_until_us) {
            look_around(1000);
            wall_origin_us = wall_us() - board_us();
            continue;
        }
        serve_port();
        board_run(SLICE_US, false);
        int64_t ahead_us = (int64_t)(wall_origin_us + board_us()) - (int64_t)wall_us();
        if (ahead_us < -LATE_US) wall_origin_us = wall_us() - board_us();
        look_around(ahead_us > 0 ? ahead_us : 0);
    }
}

static void listen_for_control(void) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(options.control) >= sizeof address.sun_path) errno = ENAMETOOLONG, fail(options.control);
    strcpy(address.sun_path, options.control);
    unlink(options.control);
    control_fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (control_fd < 0 || bind(control_fd, (struct sockaddr *)&address, sizeof address) != 0 || listen(control_fd, CLIENTS) != 0)
        fail(options.control);
}

static void parse_options(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (strcmp(argv[i], "--stepped") == 0) { options.stepped = true; continue; }
        if (strcmp(argv[i], "--firmware") == 0) options.firmware = value;
        if (strcmp(argv[i], "--bootloader") == 0) options.bootloader = value;
        if (strcmp(argv[i], "--link") == 0) options.link = value;
        if (strcmp(argv[i], "--control") == 0) options.control = value;
        i++;
    }
    if (options.firmware && options.control && (options.stepped || options.link)) return;
    fputs("simboard --firmware ELF --control SOCKET (--link PATH | --stepped) [--bootloader HEX]\n", stderr);
    exit(2);
}

int main(int argc, char **argv) {
    parse_options(argc, argv);
    signal(SIGPIPE, SIG_IGN);
    if (!board_begin(options.firmware, options.bootloader)) errno = EINVAL, fail(options.firmware);
    if (!options.stepped) plug_in();
    listen_for_control();
    if (options.stepped) while (!quit) look_around(-1);
    else run_with_the_wall_clock();
    unlink(options.control);
    if (options.link) unlink(options.link);
    return 0;
}
