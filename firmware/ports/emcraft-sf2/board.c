/*
 * The board emcraft-sf2: a SmartFusion2 with a Cortex-M3 at 142 MHz, 64 KB of fast memory and 64 MB
 * of DDR. Its first UART, a 16550 with queues of 16 bytes, is the line to the host.
 *
 * qemu-system-arm -M emcraft-sf2 -nographic -monitor none -serial pty -kernel build/emcraft-sf2.elf
 */
#include "board.h"

#include "voxel_device.h"

#define UART_DATA REGISTER(0x40000000U)
#define UART_INTERRUPTS REGISTER(0x40000004U) /* bit 0: a byte is there */
#define UART_QUEUES REGISTER(0x40000008U)     /* bit 0: on; bits 1, 2: empty both */
#define UART_FORMAT REGISTER(0x4000000CU)     /* 3: 8 data bits, no parity, 1 stop bit */
#define UART_STATE REGISTER(0x40000014U)      /* bit 0: a byte is there; bit 5: may be written */

const uint32_t board_clock_hz = 142000000U;
const uint32_t board_interrupt = 10;
const char board_name[] = "voxdisplay on emcraft-sf2";

void board_start_uart(void)
{
    UART_FORMAT = 3;
    UART_QUEUES = 7;
    UART_INTERRUPTS = 1;
}

void board_receive(void)
{
    while (UART_STATE & 1U) {
        vxd_receive((uint8_t)UART_DATA);
    }
}

void board_send(uint8_t byte)
{
    while ((UART_STATE & 0x20U) == 0) {
    }
    UART_DATA = byte;
}
