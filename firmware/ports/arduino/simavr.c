/*
 * An Arduino Uno as libsimavr emulates it, with its UART on a pseudo-terminal.
 *
 *   simavr PROGRAM.elf
 *
 * The first line of output is a JSON object with the port. Not a part of any device: it is there to
 * try the sketch without a board.
 */
#define _XOPEN_SOURCE 600
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

/* Instructions between two looks at the terminal: less than a byte takes on the line. */
#define BURST 300

/* Registers of the ATmega328P's UART, and their bits UDRE and TXEN. */
#define UCSR0A 0xC0
#define UCSR0B 0xC1
#define UDRE 0x20
#define TXEN 0x08

static int terminal;
static bool may_send = true;
static bool has_sent;

static void on_output(struct avr_irq_t *irq, uint32_t value, void *unused)
{
    const unsigned char byte = (unsigned char)value;

    (void)irq;
    (void)unused;
    has_sent = true;
    while (write(terminal, &byte, 1) != 1) {
    }
}

static void on_xon(struct avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)value;
    (void)unused;
    may_send = true;
}

static void on_xoff(struct avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)value;
    (void)unused;
    may_send = false;
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
    return tcsetattr(other, TCSANOW, &raw) == 0 ? file : -1;
}

int main(int count, char **words)
{
    elf_firmware_t firmware;
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    uint32_t flags = 0;

    memset(&firmware, 0, sizeof firmware);
    if (count != 2 || avr == NULL || elf_read_firmware(words[1], &firmware) != 0) {
        fprintf(stderr, "simavr: needs a program for an ATmega328P\n");
        return 2;
    }
    terminal = open_terminal();
    if (terminal < 0) {
        perror("simavr: no pseudo-terminal");
        return 1;
    }
    firmware.frequency = 16000000;
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_t *uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), 0);
    avr_irq_register_notify(uart + UART_IRQ_OUTPUT, on_output, NULL);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XON, on_xon, NULL);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XOFF, on_xoff, NULL);
    printf("{\"port\": \"%s\"}\n", ptsname(terminal));
    fflush(stdout);
    for (;;) {
        struct pollfd wait = {terminal, POLLIN, 0};
        unsigned char byte;

        for (int i = 0; i < BURST; i++) {
            const int state = avr_run(avr);

            if (state == cpu_Done || state == cpu_Crashed) {
                fprintf(stderr, "simavr: the program has ended\n");
                return 1;
            }
        }
        /* A program's write to UCSR0A has cleared UDRE, which a real UART keeps. */
        if (!has_sent && (avr->data[UCSR0B] & TXEN) != 0) {
            avr->data[UCSR0A] |= UDRE;
        }
        while (may_send && poll(&wait, 1, 0) > 0 && read(terminal, &byte, 1) == 1) {
            avr_raise_irq(uart + UART_IRQ_INPUT, byte);
        }
    }
}
