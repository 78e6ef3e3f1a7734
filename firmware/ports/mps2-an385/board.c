/*
 * The board mps2-an385: a Cortex-M3 at 25 MHz, whose first UART is the line to the host.
 *
 * qemu-system-arm -M mps2-an385 -nographic -monitor none -serial pty -kernel build/mps2-an385.elf
 */
#include "board.h"

#include "voxel_device.h"

#define UART_DATA REGISTER(0x40004000U)
#define UART_STATE REGISTER(0x40004004U) /* bit 0: transmitter full; bit 1: a byte is there */
#define UART_CTRL REGISTER(0x40004008U)  /* bits 0, 1: enable both ways; bit 3: interrupt */
#define UART_CLEAR REGISTER(0x4000400CU) /* bit 1: the receive interrupt */
#define UART_DIVIDER REGISTER(0x40004010U)

const uint32_t board_clock_hz = 25000000U;
const uint32_t board_interrupt = 0;
const char board_name[] = "voxdisplay on mps2-an385";

void board_start_uart(void)
{
    UART_DIVIDER = 16;
    UART_CTRL = 1U | 2U | 8U;
}

void board_receive(void)
{
    UART_CLEAR = 2;
    while (UART_STATE & 2U) {
        vxd_receive((uint8_t)UART_DATA);
    }
}

void board_send(uint8_t byte)
{
    while (UART_STATE & 1U) {
    }
    UART_DATA = byte;
}
