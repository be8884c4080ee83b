// Arithmetic on LANES candidates at once: in each lane, bit by bit, what CasADi computes for that candidate alone.
#include <math.h>

#if !defined(LANES)
#if defined(__AVX512F__)
#define LANES 8
#else
#define LANES 4
#endif
#endif

typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));
typedef long long mask __attribute__((vector_size(LANES * sizeof(long long))));

// Macros rather than functions: a compiler spends most of its time inlining tens of thousands of calls.
#define all(c) ((c) - (lanes){})
#define bits(m) ((lanes)(m))
#define whole(a) ((mask)(a))
#define SIGN (-0x7fffffffffffffffLL - 1)
#define ONE 0x3ff0000000000000LL

#define number(m) bits((m) & ONE)
#define truth(a) ((a) != 0.0)
#define where(m, a) bits((m) & whole(a))

static inline bool any(mask m) {
    long long together = 0;
    for (int i = 0; i < LANES; i++) together |= m[i];
    return together != 0;
}

#define fabs_(a) bits(whole(a) & ~SIGN)
#define copysign_(a, s) bits((whole(a) & ~SIGN) | (whole(s) & SIGN))
#define sign_(a) ((a) < 0.0 ? all(-1.0) : (a) > 0.0 ? all(1.0) : (a))

// fmin and fmax ignore a NaN where the other operand is none
#define fmin_(a, b) (((a) < (b)) | ((b) != (b)) ? (a) : (b))
#define fmax_(a, b) (((a) > (b)) | ((b) != (b)) ? (a) : (b))

#define EACH(f) \
    static inline lanes f##_(lanes a) { \
        for (int i = 0; i < LANES; i++) a[i] = f(a[i]); \
        return a; \
    }
#define EACH_PAIR(f) \
    static inline lanes f##_(lanes a, lanes b) { \
        for (int i = 0; i < LANES; i++) a[i] = f(a[i], b[i]); \
        return a; \
    }

// One instruction for all lanes. Its intrinsics would bring a header that takes longer to read than most programs.
#define AT_ONCE(f, instruction, place) \
    static inline lanes f##_(lanes a) { \
        lanes result; \
        __asm__(instruction : "=" place (result) : place (a)); \
        return result; \
    }
#if defined(__AVX512F__) && LANES == 8
AT_ONCE(sqrt, "vsqrtpd %1, %0", "v")
AT_ONCE(floor, "vrndscalepd $9, %1, %0", "v") // toward negative infinity, without exceptions
AT_ONCE(ceil, "vrndscalepd $10, %1, %0", "v") // toward positive infinity, without exceptions
#elif defined(__AVX__) && LANES == 4
AT_ONCE(sqrt, "vsqrtpd %1, %0", "x")
AT_ONCE(floor, "vroundpd $9, %1, %0", "x")
AT_ONCE(ceil, "vroundpd $10, %1, %0", "x")
#else
EACH(sqrt)
EACH(floor)
EACH(ceil)
#endif
EACH(exp)
EACH(log)
EACH(sinh)
EACH(cosh)
EACH(tanh)
EACH(asinh)
EACH(acosh)
EACH(atanh)
EACH(erf)
EACH(log1p)
EACH(expm1)
EACH_PAIR(pow)
EACH_PAIR(fmod)
EACH_PAIR(hypot)

