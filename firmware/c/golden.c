/* The golden bits through the C interface, on the host and on the target: the inputs of firmware/golden/src/inputs.rs
   once more, and a hash of every answer. The rig is that of the exported header named by RIG_HEADER. */
#include "eft.h"
#include RIG_HEADER

#if defined(__arm__)
#include "board.h"
#else
#include <stdio.h>
#endif
#include <string.h>

#define STEPS 100000u
#define CHANNELS 5u

static const uint32_t special[] = {
  0x7fc00000u, 0xffc00000u, 0x7fc12345u, 0xffffffffu, 0x7f800001u, 0xff800001u, 0x7fa00000u, 0xffbfffffu,
  0x7f800000u, 0xff800000u, 0x00000000u, 0x80000000u,
  0x00000001u, 0x80000001u, 0x007fffffu, 0x807fffffu, 0x00800000u, 0x80800000u,
  0x7f7fffffu, 0xff7fffffu,
  0x5368d4a4u, 0x5368d4a5u, 0x5368d4a6u, 0xd368d4a4u, 0xd368d4a5u, 0xd368d4a6u,
  0x3f7fffffu, 0x3f800000u, 0x3f800001u, 0xbf7fffffu, 0xbf800000u, 0xbf800001u};
#define SPECIALS ((uint32_t)(sizeof special / sizeof special[0]))

static const float scales[CHANNELS] = {1.0e4f, 1.3f, 1.6e5f, 1.2f, 1.0e-3f};

static uint32_t word;

static uint32_t next(void)
{
  word ^= word << 13;
  word ^= word >> 17;
  word ^= word << 5;
  return word;
}

static float of_bits(uint32_t bits)
{
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static uint32_t bits_of(float value)
{
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

static float regular(float scale)
{
  return (float)(int32_t)next() * (scale / 2147483648.0f);
}

/* The channels of tick n; 0 when there is none. */
static int tick(uint32_t n, float channels[CHANNELS])
{
  uint32_t i;
  if (n < STEPS) {
    for (i = 0u; i < CHANNELS; i++) {
      switch (next() % 16u) {
      case 0u:
        channels[i] = of_bits(special[next() % SPECIALS]);
        break;
      case 1u:
        channels[i] = of_bits(next());
        break;
      default:
        channels[i] = regular(scales[i]);
        break;
      }
    }
  } else {
    const uint32_t at = n - STEPS;
    const uint32_t pair = at / (SPECIALS * SPECIALS), first = at / SPECIALS % SPECIALS, second = at % SPECIALS;
    if (pair / CHANNELS >= CHANNELS) {
      return 0;
    }
    for (i = 0u; i < CHANNELS; i++) {
      const float ordinary = regular(scales[i]);
      channels[i] = i == pair % CHANNELS   ? of_bits(special[second])
                    : i == pair / CHANNELS ? of_bits(special[first])
                                           : ordinary;
    }
  }
  return 1;
}

static uint64_t hash;

static void add(uint32_t value)
{
  hash = (hash ^ value) * UINT64_C(0x100000001b3);
}

typedef uint8_t (*step)(const eft_controller_f32 *, eft_state_f32 *, const eft_input_f32 *, eft_output_f32 *);

static eft_controller_f32 config;

/* The hash of a whole replay; `both` adds the compensation signal and the further flow. */
static int replay(step function, int both)
{
  eft_state_f32 state;
  float c[CHANNELS];
  uint32_t n;
  word = 2463534242u;
  hash = UINT64_C(0xcbf29ce484222325);
  if (eft_reset_f32(&state) != EFT_OK) {
    return 0;
  }
  for (n = 0u; tick(n, c); n++) {
    eft_input_f32 input;
    eft_output_f32 output;
    input.command = c[0];
    input.velocity = c[1];
    input.force = c[2];
    input.spool = c[3];
    input.further_flow = both ? c[4] : 0.0f;
    if (function(&config, &state, &input, &output) != EFT_OK) {
      return 0;
    }
    add(bits_of(output.valve_command));
    if (both) {
      add(bits_of(output.compensation));
    }
    add(output.status);
  }
  return 1;
}

static void print(const char *text)
{
#if defined(__arm__)
  (void)semihost(SYS_WRITE0, text);
#else
  (void)fputs(text, stdout);
#endif
}

static int report(const char *name, step function, int both)
{
  char digits[18];
  int i;
  if (!replay(function, both)) {
    return 0;
  }
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

static int run(void)
{
  return eft_abi_version() == EFT_ABI_VERSION && eft_configure_f32(&EFT_RIG, &config, NULL) == EFT_OK &&
         eft_check_f32(&config, &EFT_RIG) == EFT_OK && report("controller", eft_step_f32, 0) &&
         report("compensation", eft_compensation_step_f32, 0) && report("further_flow", eft_step_f32, 1);
}

#if defined(__arm__)
void sys_tick(void)
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
