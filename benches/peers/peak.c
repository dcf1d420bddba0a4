/* The peak of one core: independent fused multiplications and additions in AVX2, enough to hide their latency. */
#include <immintrin.h>

/* Runs `n` rounds of ten operations on four doubles each; the sum prevents their removal by the compiler. */
__attribute__((target("avx2,fma"))) double eft_peak(long n) {
  const __m256d step = _mm256_set1_pd(1e-9), factor = _mm256_set1_pd(1.0000000001);
  /* Single variables stay in registers, while an array would not. */
  __m256d a = step, b = step, c = step, d = step, e = step, f = step, g = step, h = step, i = step, j = step;
#define ON(x) x = _mm256_fmadd_pd(x, factor, step)
  for (long round = 0; round < n; round++) {
    ON(a), ON(b), ON(c), ON(d), ON(e), ON(f), ON(g), ON(h), ON(i), ON(j);
    __asm__("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d), "+x"(e), "+x"(f), "+x"(g), "+x"(h), "+x"(i), "+x"(j));
  }
#undef ON
  const __m256d sum = a + b + c + d + e + f + g + h + i + j;
  return sum[0] + sum[1] + sum[2] + sum[3];
}
