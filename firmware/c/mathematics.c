/* A program of the host whose own arithmetic needs functions that the archive has as well, beside those of the C
   library. The linker takes them from the archive if it comes first, as pkg-config and CMake have it. */
#include <math.h>
#include <stdlib.h>

#include "eft.h"

int main(int count, char **arguments)
{
  const double x = count + strtod(count > 1 ? arguments[1] : "0.25", NULL);
  const double found = fmod(x, 0.5) + cbrt(8.0 * x * x * x) + fma(x, x, -x * x);
  return eft_abi_version() == EFT_ABI_VERSION && fabs(found - 2.75) < 1e-12 ? EXIT_SUCCESS : EXIT_FAILURE;
}
