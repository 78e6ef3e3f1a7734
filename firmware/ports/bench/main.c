/*
 * Packets to the core on a bare processor, whose instructions an emulator counts: the bytes of
 * wire.inc arrive as an interrupt would bring them, and the program ends.
 */
#include <stddef.h>

#include "voxel_device.h"

static const uint8_t wire[] = {
#include "wire.inc"
};

extern uint8_t data_start[], data_end[], bss_start[], bss_end[], stack_top[];
extern const uint8_t data_image[];

void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memset(void *to, int byte, size_t count);
void reset(void);

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

void vxd_send(uint8_t byte)
{
    (void)byte;
}

/* End the emulation by semihosting: the program has left. */
static void leave(void)
{
    register uint32_t call __asm("r0") = 0x18;
    register uint32_t reason __asm("r1") = 0x20026;

    __asm volatile("bkpt 0xab" ::"r"(call), "r"(reason));
    for (;;) {
    }
}

void reset(void)
{
    static const struct vxd_identity identity = {1, 0, "", "", ""};

    memcpy(data_start, data_image, (size_t)(data_end - data_start));
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    vxd_start(&identity);
    for (size_t i = 0; i < sizeof wire; i++) {
        vxd_receive(wire[i]);
        if (wire[i] == 0) {
            while (vxd_poll()) {
            }
        }
    }
    leave();
}

__attribute__((section(".vectors"), used)) static void *const vectors[2] = {stack_top, reset};
