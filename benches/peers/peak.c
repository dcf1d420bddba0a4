/* What one core can do: independent additions and multiplications in AVX2, without contraction as in the package. */
#include <immintrin.h>

/* Runs `n` rounds of 8 + 8 operations on four doubles each; the sum keeps them from being left out. */
__attribute__((target("avx2"))) double eft_peak(long n) {
  __m256d a[8], m[8], step = _mm256_set1_pd(1e-9), factor = _mm256_set1_pd(1.0000000001);
  for (int i = 0; i < 8; i++) a[i] = _mm256_set1_pd(i), m[i] = _mm256_set1_pd(1 + i);
  for (long r = 0; r < n; r++)
    for (int i = 0; i < 8; i++) {
      a[i] = _mm256_add_pd(a[i], step);
      m[i] = _mm256_mul_pd(m[i], factor);
      __asm__("" : "+x"(a[i]), "+x"(m[i]));
    }
  double sum = 0, four[4];
  for (int i = 0; i < 8; i++) {
    _mm256_storeu_pd(four, _mm256_add_pd(a[i], m[i]));
    sum += four[0] + four[1] + four[2] + four[3];
  }
  return sum;
}
