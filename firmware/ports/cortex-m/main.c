/*
 * The device on a bare Cortex-M: start-up, interrupts and main loop; board.h is the board's part.
 *
 * The UART's interrupt fills the core's ring; SysTick is the refresh.
 */
#include <string.h>

#include "../memory.h"
#include "board.h"

#ifndef REFRESH_HZ
#define REFRESH_HZ 50
#endif

#define SYSTICK_CTRL REGISTER(0xE000E010U)
#define SYSTICK_LOAD REGISTER(0xE000E014U)
#define SYSTICK_VALUE REGISTER(0xE000E018U)
#define INTERRUPTS_ENABLE REGISTER(0xE000E100U)
#define FIRST_INTERRUPT 16

extern uint8_t data_start[], data_end[], bss_start[], bss_end[], stack_top[];
extern const uint8_t data_image[];

static volatile uint32_t ticks;
static uint32_t ticks_taken;
static volatile bool heard;

void reset(void);
int main(void);

void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    uint8_t *t = to;
    const uint8_t *f = from;

    for (; count != 0; count--) {
        *t++ = *f++;
    }
    return to;
}

void *memset(void *to, int byte, size_t count)
{
    for (uint8_t *t = to; count != 0; count--) {
        *t++ = (uint8_t)byte;
    }
    return to;
}

static void on_systick(void)
{
    ticks++;
}

static void on_bytes(void)
{
    board_receive();
    heard = true;
}

static void on_fault(void)
{
    for (;;) {
    }
}

void vxd_send(uint8_t byte)
{
    board_send(byte);
}

int main(void)
{
    static struct vxd_identity identity = {0, 1000U * REFRESH_HZ, board_name, "1.0", ""};

    vxd_start(&identity);
    board_start_uart();
#if REFRESH_HZ
    SYSTICK_LOAD = board_clock_hz / REFRESH_HZ - 1U;
    SYSTICK_VALUE = 0;
    SYSTICK_CTRL = 7;
#else
    SYSTICK_LOAD = 0xFFFFFF;
    SYSTICK_CTRL = 5;
#endif
    INTERRUPTS_ENABLE = 1U << board_interrupt;
    while (!heard) {
    }
    /* The moment of the first byte is as random as a board without a clock can have it. */
    identity.boot = (uint16_t)(SYSTICK_VALUE ^ SYSTICK_VALUE >> 8 ^ ticks << 7);
    for (;;) {
        heard = false;
        while (vxd_poll()) {
        }
        if (ticks_taken != ticks) {
            ticks_taken = ticks;
            vxd_tick();
            continue;
        }
        /* Sleep, unless a byte or a tick has come since; with interrupts off, one still wakes. */
        VXD_LOCK();
        if (!heard && ticks_taken == ticks) {
            __asm volatile("wfi");
        }
        VXD_UNLOCK();
    }
}

void reset(void)
{
    memcpy(data_start, data_image, (size_t)(data_end - data_start));
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    main();
}

/* The UART's interrupt has another number on each board: all of them lead to it. */
#define EIGHT on_bytes, on_bytes, on_bytes, on_bytes, on_bytes, on_bytes, on_bytes, on_bytes

__attribute__((section(".vectors"), used)) static void *const vectors[FIRST_INTERRUPT + 32] = {
    stack_top, reset, on_fault, on_fault, on_fault, on_fault, on_fault, 0, 0, 0, 0,
    on_fault, on_fault, 0, on_fault, on_systick, EIGHT, EIGHT, EIGHT, EIGHT};
