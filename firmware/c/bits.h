/* Common parts of the golden images: the generator of inputs, the hash of outputs, and its print. */
#ifndef BITS_H
#define BITS_H

#include <stdint.h>
#include <string.h>

#if defined(__arm__)
#include "board.h"
#else
#include <stdio.h>
#endif

static const uint32_t special[] = {
  0x7fc00000u, 0xffc00000u, 0x7fc12345u, 0xffffffffu, 0x7f800001u, 0xff800001u, 0x7fa00000u, 0xffbfffffu,
  0x7f800000u, 0xff800000u, 0x00000000u, 0x80000000u,
  0x00000001u, 0x80000001u, 0x007fffffu, 0x807fffffu, 0x00800000u, 0x80800000u,
  0x7f7fffffu, 0xff7fffffu,
  0x5368d4a4u, 0x5368d4a5u, 0x5368d4a6u, 0xd368d4a4u, 0xd368d4a5u, 0xd368d4a6u,
  0x3f7fffffu, 0x3f800000u, 0x3f800001u, 0xbf7fffffu, 0xbf800000u, 0xbf800001u};
#define SPECIALS ((uint32_t)(sizeof special / sizeof special[0]))

static uint32_t word;

static inline uint32_t next(void)
{
  word ^= word << 13;
  word ^= word >> 17;
  word ^= word << 5;
  return word;
}

static inline float of_bits(uint32_t bits)
{
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static inline uint32_t bits_of(float value)
{
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

static inline float regular(float scale)
{
  return (float)(int32_t)next() * (scale / 2147483648.0f);
}

/* As regular, but now and then a special value or random bits. */
static inline float sample(float scale)
{
  switch (next() % 16u) {
  case 0u:
    return of_bits(special[next() % SPECIALS]);
  case 1u:
    return of_bits(next());
  default:
    return regular(scale);
  }
}

static uint64_t hash;

static inline void add(uint32_t value)
{
  hash = (hash ^ value) * UINT64_C(0x100000001b3);
}

/* Begins a replay. */
static inline void begin(uint32_t seed)
{
  word = seed;
  hash = UINT64_C(0xcbf29ce484222325);
}

static inline void print(const char *text)
{
#if defined(__arm__)
  (void)semihost(SYS_WRITE0, text);
#else
  (void)fputs(text, stdout);
#endif
}

/* One line: the rig, the replay, the hash. */
static inline int report(const char *name)
{
  char digits[18];
  int i;
  for (i = 0; i < 16; i++) {
    digits[i] = "0123456789abcdef"[hash >> (60 - 4 * i) & 15u];
  }
  digits[16] = '\n';
  digits[17] = '\0';
  print(RIG_NAME " ");
  print(name);
  print(" ");
  print(digits);
  return 1;
}

/* The replays; 0 where a call was refused. */
static int run(void);

#if defined(__arm__)
void sys_tick(void)
{
}

void pend_sv(void)
{
}

void program(void)
{
  leave(run() ? 0u : 2u);
}
#else
int main(void)
{
  return run() ? 0 : 2;
}
#endif

#endif
