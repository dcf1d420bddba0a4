/* Start-up and semihosting of the C images. */
#include "board.h"

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

uint32_t semihost(uint32_t operation, const void *block)
{
  register uint32_t r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = block;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void leave(uint32_t code)
{
  const uint32_t block[2] = {0x20026u, code};
  for (;;) {
    (void)semihost(SYS_EXIT_EXTENDED, block);
  }
}

/* Start-up: memory, FPU, vectors. */
extern uint32_t _sidata[], _sdata[], _edata[], _sbss[], _ebss[], _estack[];

void reset(void);
void reset(void)
{
  CPACR |= 0xFu << 20;
  __asm__ volatile("dsb\n isb");
  const uint32_t *from = _sidata;
  for (uint32_t *to = _sdata; to < _edata; to++, from++) {
    *to = *from;
  }
  for (uint32_t *to = _sbss; to < _ebss; to++) {
    *to = 0u;
  }
  program();
}

void fault(void);
void fault(void)
{
  leave(3u);
}

typedef void (*handler)(void);
__attribute__((section(".vectors"), used)) static const struct {
  uint32_t *stack;
  handler handlers[15];
} vectors = {_estack, {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, pend_sv, sys_tick}};
