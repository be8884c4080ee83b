// Eight numbers at once, one for each of eight postures. Every operation is IEEE 754's in each lane, whatever the
// instruction set that carries it out: results are the same on every machine.
#pragma once
#include <cmath>

namespace core {

constexpr int LANES = 8;
typedef double Lanes __attribute__((vector_size(LANES * sizeof(double))));
typedef long long Mask __attribute__((vector_size(LANES * sizeof(long long))));  // all bits of a lane, or none

#define INLINE inline __attribute__((always_inline))

INLINE Lanes all(double value) { return value - Lanes{}; }
INLINE Lanes least(Lanes a, Lanes b) { return a < b ? a : b; }
INLINE Lanes most(Lanes a, Lanes b) { return a > b ? a : b; }
INLINE Lanes size(Lanes a) { return (Lanes)((Mask)a & 0x7fffffffffffffffLL); }

INLINE Lanes root(Lanes a) {
#if defined(__AVX512F__)
    Lanes result;
    __asm__("vsqrtpd %1, %0" : "=v"(result) : "v"(a));
    return result;
#else
    for (int lane = 0; lane < LANES; ++lane) a[lane] = std::sqrt(a[lane]);
    return a;
#endif
}

// One bit for each lane.
INLINE unsigned bits(Mask mask) {
    unsigned found = 0;
    for (int lane = 0; lane < LANES; ++lane) found |= (mask[lane] & 1u) << lane;
    return found;
}
constexpr unsigned EVERY_LANE = (1u << LANES) - 1;

// Sine and cosine, within 2 units in the last place for angles up to 1e5 rad: the angle less a multiple of pi / 2 in
// three parts (Cody and Waite), then polynomials that are best between -pi / 4 and pi / 4.
INLINE void sine_cosine(Lanes angle, Lanes& sine, Lanes& cosine) {
    const double two_over_pi = 6.36619772367581382433e-01;
    const double part_1 = 1.57079632673412561417e+00, part_2 = 6.07710050630396597660e-11;
    const double part_3 = 2.02226624879595063154e-21;
    const double rounder = 6755399441055744.0;  // 1.5 * 2^52: what is added to it is rounded to a whole number
    const Lanes shifted = angle * two_over_pi + rounder, turns = shifted - rounder;
    const Mask quarter = (Mask)shifted & 3LL;
    const Lanes r = ((angle - turns * part_1) - turns * part_2) - turns * part_3, z = r * r;
    const Lanes s = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
        -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const Lanes c = (1.0 - 0.5 * z) + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (
        2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (
        2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    const Mask swapped = (quarter & 1LL) != 0, down = (quarter & 2LL) != 0, left = ((quarter + 1LL) & 2LL) != 0;
    const Lanes first = swapped ? c : s, second = swapped ? s : c;
    sine = down ? -first : first;
    cosine = left ? -second : second;
}

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
