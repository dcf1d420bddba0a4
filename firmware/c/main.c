/* A control loop in C as it would run on a board: timer tick, sample, step, command, watchdog on overrun. Samples come
   from the file "to-firmware" and commands go to "from-firmware", by semihosting, where a board has its converters. */
#include "board.h"
#include "firmware.h"

#define CLOCK 25000000u /* of both QEMU machines' timers, Hz */

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

static uint32_t open_file(const char *name, uint32_t length, uint32_t mode)
{
  const uint32_t block[3] = {(uint32_t)(uintptr_t)name, mode, length};
  return semihost(SYS_OPEN, block);
}

/* Bytes that were not transferred. */
static uint32_t transfer(uint32_t operation, uint32_t file, void *bytes, uint32_t length)
{
  uint32_t left = length;
  while (left > 0u) {
    const uint32_t block[3] = {file, (uint32_t)(uintptr_t)bytes + (length - left), left};
    const uint32_t rest = semihost(operation, block);
    if (rest >= left) {
      break;
    }
    left = rest;
  }
  return left;
}

/* Only the interrupt writes it. */
static volatile uint32_t ticks;

void sys_tick(void)
{
  ticks = ticks + 1u;
}

void program(void)
{
  if (eft_abi_version() != EFT_ABI_VERSION || !start()) {
    leave(2u);
  }
  const uint32_t input = open_file("to-firmware", 11u, 1u);
  const uint32_t output = open_file("from-firmware", 13u, 5u);
  SYST_RVR = (uint32_t)((double)CLOCK / SAMPLE_RATE) - 1u;
  SYST_CVR = 0u;
  SYST_CSR = 7u;
  uint32_t done = ticks;
  for (;;) {
    while (ticks == done) {
      __asm__ volatile("wfi");
    }
    done = done + 1u;
    sample in;
    answer out;
    if (transfer(SYS_READ, input, &in, sizeof in) != 0u) {
      leave(0u); /* the end of the test */
    }
    if (!tick(&in, &out) || transfer(SYS_WRITE, output, &out, sizeof out) != 0u) {
      leave(2u);
    }
    if (ticks != done) {
      leave(4u); /* the watchdog: the work must be done before the next tick */
    }
  }
}
