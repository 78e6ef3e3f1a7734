/* What a board tells the port for bare Cortex-M cores: its clock, its name and its UART. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* Frequency of SysTick; number of the interrupt by which the UART receives, below 32. */
extern const uint32_t board_clock_hz;
extern const uint32_t board_interrupt;
extern const char board_name[];

/* Switch the UART on, with its receive interrupt. */
void board_start_uart(void);

/* Take the bytes that the UART has: clear its interrupt, then call vxd_receive for each. */
void board_receive(void);

/* Send one byte; wait until the UART takes it. */
void board_send(uint8_t byte);

#endif
