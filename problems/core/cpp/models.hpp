// Taylor models of eight cells of time at once: a cubic in s, -1 <= s <= 1, and how far a function may be from it.
//
// With u = 2^-53, an operation computes every coefficient as a sum of at most four products, and the rest as a sum of
// sizes, by fewer than 20 roundings each: of the sum of the sizes of all its terms they lose less than 24 u. ROUNDED
// times that sum, which is added to the rest, is more than that, and more than what computing it loses (proof.md).
#pragma once
#include "lanes.hpp"

namespace core {

constexpr double UNIT = 1.0 / 9007199254740992.0, ROUNDED = 64.0 * UNIT;
constexpr double LARGEST_ANGLE = 1e5;  // rad: where sines are known
constexpr int DEGREE = 3;

struct Model {
    Lanes c[DEGREE + 1], rest;  // lowest power first
};

// Least and largest values of a cell, rounded outwards.
struct Range {
    Lanes low, high;
};

INLINE Lanes nothing() { return Lanes{}; }
INLINE Lanes unbounded() { return all(HUGE_VAL); }
INLINE Model constant(Lanes value) { return {{value, nothing(), nothing(), nothing()}, nothing()}; }

// The largest size of the terms from a power on.
INLINE Lanes tail(const Model& a, int from) {
    Lanes sum = size(a.c[DEGREE]);
    for (int i = DEGREE - 1; i >= from; --i) sum += size(a.c[i]);
    return sum;
}
INLINE Lanes largest(const Model& a) { return tail(a, 0) + a.rest; }

// A number that is off by no more than rounding of a size.
INLINE void slack(Model& a, Lanes size) { a.rest += ROUNDED * size; }
INLINE void slack_by(Model& a, const Model& b) { slack(a, largest(b)); }
template <class T>
INLINE void slack(T&, Lanes) {}
template <class T>
INLINE void slack_by(T&, const T&) {}

INLINE Model operator+(const Model& a, const Model& b) {
    Model sum;
    for (int i = 0; i <= DEGREE; ++i) sum.c[i] = a.c[i] + b.c[i];
    sum.rest = a.rest + b.rest;
    sum.rest += ROUNDED * (tail(sum, 0) + sum.rest);
    return sum;
}
INLINE Model operator-(const Model& a) { return {{-a.c[0], -a.c[1], -a.c[2], -a.c[3]}, a.rest}; }
INLINE Model operator-(const Model& a, const Model& b) { return a + -b; }
INLINE Model operator+(Lanes a, const Model& b) { return constant(a) + b; }
INLINE Model operator+(double a, const Model& b) { return all(a) + b; }

INLINE Model operator*(Lanes a, const Model& b) {
    Model product;
    for (int i = 0; i <= DEGREE; ++i) product.c[i] = a * b.c[i];
    product.rest = size(a) * (b.rest + ROUNDED * largest(b));
    return product;
}
INLINE Model operator*(double a, const Model& b) { return all(a) * b; }

inline Model operator*(const Model& a, const Model& b) {
    Model product;
    const Lanes *x = a.c, *y = b.c;
    product.c[0] = x[0] * y[0];
    product.c[1] = x[0] * y[1] + x[1] * y[0];
    product.c[2] = x[0] * y[2] + x[1] * y[1] + x[2] * y[0];
    product.c[3] = x[0] * y[3] + x[1] * y[2] + x[2] * y[1] + x[3] * y[0];
    const Lanes third = size(y[3]), second = size(y[2]) + third, first = size(y[1]) + second;
    const Lanes one = tail(a, 0), other = size(y[0]) + first + b.rest;
    const Lanes higher = size(x[1]) * third + size(x[2]) * second + size(x[3]) * first;
    product.rest = higher + one * b.rest + a.rest * other + ROUNDED * ((one + a.rest) * other);
    return product;
}

INLINE Lanes greatest(Lanes a, Lanes b, Lanes c) { return most(most(a, b), c); }

// An upper bound: that of Bernstein's coefficients, or of c0 + (c1 + 3/4 c3) s + c2 s^2 + |c3| / 4, since s^3 is nowhere
// farther than 1/4 from 3/4 s; the smaller.
INLINE Lanes top(const Model& a) {
    const Lanes *c = a.c, third = (c[1] + c[2]) * (1.0 / 3.0), other = (c[1] - c[2]) * (1.0 / 3.0);
    const Lanes corners = most(greatest(c[0] - c[1] + c[2] - c[3], c[0] - third + c[3], c[0] + other - c[3]),
                               c[0] + c[1] + c[2] + c[3]);
    const Lanes slope = c[1] + 0.75 * c[3];
    const Mask bends = size(slope) < -2.0 * c[2];
    const Lanes vertex = c[0] - slope * slope / (4.0 * c[2]), ends = c[0] + size(slope) + c[2];
    const Lanes parabola = chosen(bends, vertex, ends) + 0.25 * size(c[3]);
    return least(corners, parabola) + (a.rest + ROUNDED * largest(a));
}
INLINE Range range(const Model& a) { return {-top(-a), top(a)}; }

// The s at which it is likely to be largest.
INLINE Lanes likely(const Model& a) {
    const Lanes slope = a.c[1] + 0.75 * a.c[3], end = chosen(slope < 0.0, all(-1.0), all(1.0));
    return chosen(size(slope) < -2.0 * a.c[2], slope / (-2.0 * a.c[2]), end);
}

// What is left of a model without its value in the middle.
INLINE Model away(const Model& a) { return {{nothing(), a.c[1], a.c[2], a.c[3]}, a.rest}; }

// f0 + f1 y + f2 y^2 + f3 y^3 of what is away from the middle, where numbers are right to rounding, and a remainder.
inline Model series(const Model& a, Lanes f0, Lanes f1, Lanes f2, Lanes f3, Lanes remainder) {
    const Model y = away(a), square = y * y;
    Model found = f0 + (f1 * y + (f2 * square + f3 * (square * y)));
    found.rest += remainder * (1.0 + ROUNDED);
    slack(found, size(f0));
    return found;
}

// |sin y - y + y^3 / 6| <= |y|^5 / 120 and |cos y - 1 + y^2 / 2| <= |y|^4 / 24 for all y.
inline void sine_cosine(const Model& angle, Model& sine, Model& cosine) {
    const Model y = away(angle), square = y * y;
    const Lanes reach = largest(y), fourth = reach * reach * reach * reach * (1.0 + ROUNDED);
    Model odd = y - (1.0 / 6.0) * (square * y), even = 1.0 + -0.5 * square;
    odd.rest += fourth * reach * (1.0 / 119.0);
    even.rest += fourth * (1.0 / 23.9);
    Lanes s, c;
    sine_cosine(angle.c[0], s, c);
    sine = s * even + c * odd;
    cosine = c * even - s * odd;
    const Lanes off = chosen(size(angle.c[0]) <= LARGEST_ANGLE, largest(odd) + largest(even), unbounded());
    slack(sine, off);
    slack(cosine, off);
}

}  // namespace core
