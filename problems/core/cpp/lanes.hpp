// Eight numbers at once, one for each of eight postures. Every operation is IEEE 754's in each lane, whatever the
// instruction set that carries it out: results are the same on every machine.
//
// Eight lanes are as many registers as they need: one vector of eight, two of four or four of two numbers. Compilers
// split wider vectors through memory, which takes several times as long.
#pragma once
#include <cmath>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace core {

#define INLINE inline __attribute__((always_inline))

constexpr int LANES = 8;
#if defined(__AVX512F__)
constexpr int WIDTH = 8;  // of a register, in numbers
#elif defined(__AVX2__)
constexpr int WIDTH = 4;
#else
constexpr int WIDTH = 2;
#endif
typedef double Doubles __attribute__((vector_size(WIDTH * sizeof(double))));
typedef long long Longs __attribute__((vector_size(WIDTH * sizeof(long long))));  // all bits of a lane, or none

template <class V>
struct Kind {
    using Number = double;
    using Mask = Longs;
};
template <>
struct Kind<Longs> {
    using Number = long long;
    using Mask = Longs;
};

// Twice as many numbers as a half holds.
template <class V>
struct Twice {
    using Number = typename Kind<V>::Number;
    V low, high;
    Number& operator[](int lane) { return reinterpret_cast<Number*>(this)[lane]; }
    const Number& operator[](int lane) const { return reinterpret_cast<const Number*>(this)[lane]; }
};
template <class V>
struct Kind<Twice<V>> {
    using Number = typename Kind<V>::Number;
    using Mask = Twice<typename Kind<V>::Mask>;
};

#define OPERATOR(op)                                                                                                   \
    template <class V>                                                                                                 \
    INLINE Twice<V> operator op(const Twice<V>& a, const Twice<V>& b) {                                                \
        return {a.low op b.low, a.high op b.high};                                                                     \
    }                                                                                                                  \
    template <class V>                                                                                                 \
    INLINE Twice<V> operator op(const Twice<V>& a, typename Kind<V>::Number b) {                                       \
        return {a.low op b, a.high op b};                                                                              \
    }                                                                                                                  \
    template <class V>                                                                                                 \
    INLINE Twice<V> operator op(typename Kind<V>::Number a, const Twice<V>& b) {                                       \
        return {a op b.low, a op b.high};                                                                              \
    }                                                                                                                  \
    template <class V, class Other>                                                                                    \
    INLINE Twice<V>& operator op##=(Twice<V>& a, const Other& b) {                                                     \
        return a = a op b;                                                                                             \
    }
OPERATOR(+)
OPERATOR(-)
OPERATOR(*)
OPERATOR(/)
OPERATOR(&)
OPERATOR(|)
#undef OPERATOR

#define COMPARISON(op)                                                                                                 \
    template <class V>                                                                                                 \
    INLINE typename Kind<Twice<V>>::Mask operator op(const Twice<V>& a, const Twice<V>& b) {                           \
        return {a.low op b.low, a.high op b.high};                                                                     \
    }                                                                                                                  \
    template <class V>                                                                                                 \
    INLINE typename Kind<Twice<V>>::Mask operator op(const Twice<V>& a, typename Kind<V>::Number b) {                  \
        return {a.low op b, a.high op b};                                                                              \
    }
COMPARISON(<)
COMPARISON(<=)
COMPARISON(>)
COMPARISON(>=)
COMPARISON(!=)
#undef COMPARISON

template <class V>
INLINE typename Kind<Twice<V>>::Mask operator>(typename Kind<V>::Number a, const Twice<V>& b) {
    return b < a;
}

template <class V>
INLINE Twice<V> operator-(const Twice<V>& a) {
    return {-a.low, -a.high};
}
template <class V>
INLINE Twice<V> operator~(const Twice<V>& a) {
    return {~a.low, ~a.high};
}

INLINE Doubles chosen(Longs mask, Doubles a, Doubles b) { return mask ? a : b; }
INLINE Doubles size(Doubles a) { return (Doubles)((Longs)a & 0x7fffffffffffffffLL); }

INLINE Doubles root(Doubles a) {
#if defined(__AVX512F__)
    Doubles result;
    __asm__("vsqrtpd %1, %0" : "=v"(result) : "v"(a));
    return result;
#elif defined(__AVX2__)
    return (Doubles)_mm256_sqrt_pd((__m256d)a);
#elif defined(__SSE2__)
    return (Doubles)_mm_sqrt_pd((__m128d)a);
#else
    for (int lane = 0; lane < WIDTH; ++lane) a[lane] = std::sqrt(a[lane]);
    return a;
#endif
}

// One bit for each lane.
INLINE unsigned bits(Longs mask) {
#if defined(__AVX2__) && !defined(__AVX512F__)
    return (unsigned)_mm256_movemask_pd((__m256d)mask);
#elif defined(__SSE2__) && !defined(__AVX512F__)
    return (unsigned)_mm_movemask_pd((__m128d)mask);
#else
    unsigned found = 0;
    for (int lane = 0; lane < WIDTH; ++lane) found |= (mask[lane] & 1u) << lane;
    return found;
#endif
}
constexpr unsigned EVERY_LANE = (1u << LANES) - 1;

// Sine and cosine, within 2 units in the last place for angles up to 1e5 rad: the angle less a multiple of pi / 2 in
// three parts (Cody and Waite), then polynomials that are best between -pi / 4 and pi / 4.
INLINE void sine_cosine(Doubles angle, Doubles& sine, Doubles& cosine) {
    const double two_over_pi = 6.36619772367581382433e-01;
    const double part_1 = 1.57079632673412561417e+00, part_2 = 6.07710050630396597660e-11;
    const double part_3 = 2.02226624879595063154e-21;
    const double rounder = 6755399441055744.0;  // 1.5 * 2^52: what is added to it is rounded to a whole number
    const Doubles shifted = angle * two_over_pi + rounder, turns = shifted - rounder;
    const Longs quarter = (Longs)shifted & 3LL;
    const Doubles r = ((angle - turns * part_1) - turns * part_2) - turns * part_3, z = r * r;
    const Doubles s = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
        -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const Doubles c = (1.0 - 0.5 * z) + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (
        2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (
        2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    const Longs swapped = (quarter & 1LL) != 0, down = (quarter & 2LL) != 0, left = ((quarter + 1LL) & 2LL) != 0;
    const Doubles first = swapped ? c : s, second = swapped ? s : c;
    sine = down ? -first : first;
    cosine = left ? -second : second;
}

// The same of more numbers, half by half.
template <class M, class V>
INLINE Twice<V> chosen(const Twice<M>& mask, const Twice<V>& a, const Twice<V>& b) {
    return {chosen(mask.low, a.low, b.low), chosen(mask.high, a.high, b.high)};
}
template <class V>
INLINE Twice<V> size(const Twice<V>& a) {
    return {size(a.low), size(a.high)};
}
template <class V>
INLINE Twice<V> root(const Twice<V>& a) {
    return {root(a.low), root(a.high)};
}
template <class V>
INLINE unsigned bits(const Twice<V>& mask) {
    return bits(mask.low) | bits(mask.high) << sizeof(V) / sizeof(double);
}
template <class V>
INLINE void sine_cosine(const Twice<V>& angle, Twice<V>& sine, Twice<V>& cosine) {
    sine_cosine(angle.low, sine.low, cosine.low);
    sine_cosine(angle.high, sine.high, cosine.high);
}

// So many times what a vector holds.
template <class V, int TIMES>
struct Of {
    using Type = typename Of<Twice<V>, TIMES / 2>::Type;
};
template <class V>
struct Of<V, 1> {
    using Type = V;
};
using Lanes = Of<Doubles, LANES / WIDTH>::Type;
using Mask = Of<Longs, LANES / WIDTH>::Type;

INLINE Lanes all(double value) { return value - Lanes{}; }
INLINE Lanes least(const Lanes& a, const Lanes& b) { return chosen(a < b, a, b); }
INLINE Lanes most(const Lanes& a, const Lanes& b) { return chosen(a > b, a, b); }

// Three numbers in each lane.
struct Point {
    Lanes x, y, z;
};

INLINE Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
INLINE Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
INLINE Lanes dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE Lanes length(const Point& a) { return root(dot(a, a)); }
INLINE Point cross(const Point& a, const Point& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace core
