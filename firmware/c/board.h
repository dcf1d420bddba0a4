/* The board for both C images: start-up, and semihosting in place of peripherals. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

enum { SYS_OPEN = 0x01, SYS_WRITE0 = 0x04, SYS_WRITE = 0x05, SYS_READ = 0x06, SYS_EXIT_EXTENDED = 0x20 };

uint32_t semihost(uint32_t operation, const void *block);
/* Ends the emulation. */
void leave(uint32_t code);
/* The program; it ends with leave(). */
void program(void);
/* The timer interrupt. */
void sys_tick(void);
/* The task below it. */
void pend_sv(void);

#endif
