/*
 * The device on a pseudo-terminal, or on lines of standard input.
 *
 *   device [--refresh HZ] [--boot N] [--name S] [--firmware S] [--serial S] [--script]
 *
 * The first line of output is a JSON object with the port. With --script there is no port and no
 * clock: each line of standard input is a command, "r HEX" (bytes arrive), "t" (a refresh tick),
 * "d" (the connection ends) or "p" (print the front page), answered by one line of hex.
 */
#define _XOPEN_SOURCE 600
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "../memory.h"

/* Bytes after which packets are taken, as a loop beside a receive interrupt would. */
#define BURST 32U

static uint8_t out[65536];
static size_t out_size;
static int out_file = -1;

static void flush_out(void)
{
    size_t at = 0;

    while (out_file >= 0 && at < out_size) {
        ssize_t done = write(out_file, out + at, out_size - at);

        if (done > 0) {
            at += (size_t)done;
        } else if (errno != EINTR) {
            break;
        }
    }
    out_size = 0;
}

static void print_out(void)
{
    for (size_t i = 0; i < out_size; i++) {
        printf("%02x", out[i]);
    }
    out_size = 0;
}

void vxd_send(uint8_t byte)
{
    if (out_size == sizeof out) {
        if (out_file >= 0) {
            flush_out();
        } else {
            print_out();
        }
    }
    out[out_size++] = byte;
}

static void take(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        vxd_receive(bytes[i]);
        if ((i + 1U) % BURST == 0 || i + 1U == count) {
            while (vxd_poll()) {
            }
        }
    }
}

static void tick(void)
{
    vxd_tick();
    while (vxd_poll()) {
    }
}

static unsigned nibble(char c)
{
    return (unsigned)(c <= '9' ? c - '0' : (c | 32) - 'a' + 10) & 15U;
}

static int run_script(void)
{
    static char line[1 << 20];

    while (fgets(line, sizeof line, stdin) != NULL) {
        if (line[0] == 'r') {
            static uint8_t bytes[sizeof line / 2];
            size_t count = 0;

            for (const char *at = line + 2; at[0] > ' ' && at[1] > ' '; at += 2) {
                bytes[count++] = (uint8_t)(nibble(at[0]) << 4 | nibble(at[1]));
            }
            take(bytes, count);
        } else if (line[0] == 't') {
            tick();
        } else if (line[0] == 'd') {
            vxd_disconnect();
        } else if (line[0] == 'p') {
            uint32_t size;
            const uint8_t *page = memory_front(&size);

            for (uint32_t i = 0; i < size; i++) {
                printf("%02x", page[i]);
            }
        }
        print_out();
        putchar('\n');
        fflush(stdout);
    }
    return 0;
}

static double now(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Open a pseudo-terminal; its other end stays open here, so that hosts may come and go. */
static int open_terminal(void)
{
    struct termios raw;
    int file = posix_openpt(O_RDWR | O_NOCTTY);
    int other;

    if (file < 0 || grantpt(file) != 0 || unlockpt(file) != 0) {
        return -1;
    }
    other = open(ptsname(file), O_RDWR | O_NOCTTY);
    if (other < 0 || tcgetattr(other, &raw) != 0) {
        return -1;
    }
    raw.c_iflag = 0;
    raw.c_oflag = 0;
    raw.c_lflag = 0;
    raw.c_cc[VMIN] = 1;
    raw.c_cc[VTIME] = 0;
    return tcsetattr(other, TCSANOW, &raw) == 0 ? file : -1;
}

static int run_terminal(uint32_t refresh)
{
    static const char *const formats[] = {"", "mono1", "index8", "rgb565", "rgb888"};
    const double period = refresh == 0 ? 0 : 1000.0 / refresh;
    double due = now() + period;

    out_file = open_terminal();
    if (out_file < 0) {
        perror("device: no pseudo-terminal");
        return 1;
    }
    printf("{\"port\": \"%s\", \"size\": \"%dx%dx%d\", \"format\": \"%s\"}\n", ptsname(out_file),
           VXD_NX, VXD_NY, VXD_NZ, formats[VXD_FORMAT]);
    fflush(stdout);
    for (;;) {
        struct pollfd wait = {out_file, POLLIN, 0};
        double left = due - now();
        int timeout = refresh == 0 ? -1 : left <= 0 ? 0 : (int)(left * 1000) + 1;

        uint8_t bytes[1024];
        ssize_t count = 0;

        if (poll(&wait, 1, timeout) > 0) {
            count = read(out_file, bytes, sizeof bytes);
            if (count < 0 && errno != EINTR) {
                perror("device: the pseudo-terminal is gone");
                return 1;
            }
        }
        /* A busy machine may run this late: a display would have refreshed meanwhile, each time. */
        while (refresh != 0 && now() >= due) {
            tick();
            due += period;
        }
        if (count > 0) {
            take(bytes, (size_t)count);
        }
        flush_out();
    }
}

int main(int count, char **words)
{
    struct vxd_identity identity = {0, 30000, "voxdisplay reference device", "1.0", ""};
    bool script = false;

    identity.boot = (uint16_t)((unsigned)time(NULL) * 31U + (unsigned)getpid());
    for (int i = 1; i < count; i++) {
        const char *value = i + 1 < count ? words[i + 1] : NULL;

        if (strcmp(words[i], "--script") == 0) {
            script = true;
            continue;
        }
        if (value == NULL) {
            fprintf(stderr, "device: %s: no such option, or it lacks its value\n", words[i]);
            return 2;
        }
        if (strcmp(words[i], "--refresh") == 0) {
            identity.refresh = (uint32_t)(strtod(value, NULL) * 1000 + 0.5);
        } else if (strcmp(words[i], "--boot") == 0) {
            identity.boot = (uint16_t)strtoul(value, NULL, 0);
        } else if (strcmp(words[i], "--name") == 0) {
            identity.name = value;
        } else if (strcmp(words[i], "--firmware") == 0) {
            identity.firmware = value;
        } else if (strcmp(words[i], "--serial") == 0) {
            identity.serial = value;
        } else {
            fprintf(stderr, "device: %s: no such option\n", words[i]);
            return 2;
        }
        i++;
    }
    vxd_start(&identity);
    return script ? run_script() : run_terminal(identity.refresh);
}
