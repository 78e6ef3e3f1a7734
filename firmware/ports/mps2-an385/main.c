/*
 * The device on a bare Cortex-M3: the board mps2-an385, whose first UART is the line to the host.
 *
 * The UART's interrupt fills the core's ring; SysTick is the refresh. Run it with
 * qemu-system-arm -M mps2-an385 -nographic -monitor none -serial pty -kernel build/mps2-an385.elf
 */
#include <string.h>

#include "../memory.h"

#ifndef REFRESH_HZ
#define REFRESH_HZ 50
#endif
#define CLOCK_HZ 25000000U

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define UART_DATA REGISTER(0x40004000U)
#define UART_STATE REGISTER(0x40004004U) /* bit 0: transmitter full; bit 1: a byte is there */
#define UART_CTRL REGISTER(0x40004008U)  /* bits 0, 1: enable both ways; bit 3: interrupt */
#define UART_CLEAR REGISTER(0x4000400CU) /* bit 1: the receive interrupt */
#define UART_DIVIDER REGISTER(0x40004010U)
#define SYSTICK_CTRL REGISTER(0xE000E010U)
#define SYSTICK_LOAD REGISTER(0xE000E014U)
#define SYSTICK_VALUE REGISTER(0xE000E018U)
#define INTERRUPTS_ENABLE REGISTER(0xE000E100U)

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

static void on_byte(void)
{
    UART_CLEAR = 2;
    while (UART_STATE & 2U) {
        vxd_receive((uint8_t)UART_DATA);
        heard = true;
    }
}

static void on_fault(void)
{
    for (;;) {
    }
}

void vxd_send(uint8_t byte)
{
    while (UART_STATE & 1U) {
    }
    UART_DATA = byte;
}

int main(void)
{
    static struct vxd_identity identity = {0, 1000U * REFRESH_HZ, "voxdisplay on mps2-an385", "1.0",
                                           ""};

    vxd_start(&identity);
    UART_DIVIDER = 16;
    UART_CTRL = 1U | 2U | 8U;
#if REFRESH_HZ
    SYSTICK_LOAD = CLOCK_HZ / REFRESH_HZ - 1U;
    SYSTICK_VALUE = 0;
    SYSTICK_CTRL = 7;
#else
    SYSTICK_LOAD = 0xFFFFFF;
    SYSTICK_CTRL = 5;
#endif
    INTERRUPTS_ENABLE = 1; /* number 0: the first UART receives */
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

__attribute__((section(".vectors"), used)) static void *const vectors[17] = {
    stack_top, reset, on_fault, on_fault, on_fault, on_fault, on_fault, 0, 0, 0, 0,
    on_fault, on_fault, 0, on_fault, on_systick, on_byte};
