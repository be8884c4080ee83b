// Taylor models with the least and largest values they can have: the elementary operations of expressions.
//
// A range comes from the ranges of the arguments and from the model, whichever is closer; where it is narrower than the
// model, the model becomes its middle. What may be undefined somewhere in a cell is marked, and proves nothing there.
// Of the standard library's functions, results are assumed to be right to 8 units in the last place.
#pragma once
#include "models.hpp"

namespace core {

struct Bounded {
    Model model;
    Range range;
};

// The cells in which a value may be undefined, all bits of a lane or none.
struct Undefined {
    Mask cells{};
    void where(Mask more) { cells |= more; }
};

INLINE Mask finite(Lanes a) { return size(a) < HUGE_VAL; }
INLINE Range outward(const Range& a) { return {a.low - ROUNDED * size(a.low), a.high + ROUNDED * size(a.high)}; }

template <class Function>
INLINE Lanes each(Lanes a, Function&& function) {
    for (int lane = 0; lane < LANES; ++lane) a[lane] = function(a[lane]);
    return a;
}

INLINE Model chosen(Mask mask, const Model& a, const Model& b) {
    Model found;
    for (int i = 0; i <= DEGREE; ++i) found.c[i] = chosen(mask, a.c[i], b.c[i]);
    found.rest = chosen(mask, a.rest, b.rest);
    return found;
}

// A value from its model and from a range that it is in.
inline Bounded bounded(Model model, Range from, Undefined& undefined) {
    Mask known = finite(model.rest);
    for (const Lanes& c : model.c) known &= finite(c);
    const Range own = range(model);
    const Range both = {chosen(known & (own.low > from.low), own.low, from.low),
                        chosen(known & (own.high < from.high), own.high, from.high)};
    undefined.where(~(finite(both.low) & finite(both.high)));
    const Lanes middle = 0.5 * both.low + 0.5 * both.high, half = 0.5 * (both.high - both.low);
    Model flat = constant(middle);
    flat.rest = half + ROUNDED * (size(middle) + half);
    return {chosen(known & (model.rest <= flat.rest), model, flat), both};
}

INLINE Bounded exactly(double value) { return {constant(all(value)), {all(value), all(value)}}; }
INLINE Bounded input(const Model& model, Undefined& undefined) {
    return bounded(model, {-unbounded(), unbounded()}, undefined);
}

INLINE Bounded negated(const Bounded& a) { return {-a.model, {-a.range.high, -a.range.low}}; }

INLINE Bounded plus(const Bounded& a, const Bounded& b, Undefined& undefined) {
    return bounded(a.model + b.model, outward({a.range.low + b.range.low, a.range.high + b.range.high}), undefined);
}

INLINE Range corners(const Range& a, const Range& b) {
    const Lanes one = a.low * b.low, two = a.low * b.high, three = a.high * b.low, four = a.high * b.high;
    return {least(least(one, two), least(three, four)), most(most(one, two), most(three, four))};
}
INLINE Bounded times(const Bounded& a, const Bounded& b, Undefined& undefined) {
    return bounded(a.model * b.model, outward(corners(a.range, b.range)), undefined);
}

INLINE Lanes nearest_to_zero(const Range& a) { return most(most(a.low, -a.high), nothing()); }
INLINE Lanes farthest_from_zero(const Range& a) { return most(-a.low, a.high); }

INLINE Bounded squared(const Bounded& a, Undefined& undefined) {
    const Lanes near = nearest_to_zero(a.range), far = farthest_from_zero(a.range);
    return bounded(a.model * a.model, outward({near * near, far * far}), undefined);
}

// What a series is about: the values, and that from which it is developed.
INLINE Range hull(const Bounded& a) { return {least(a.range.low, a.model.c[0]), most(a.range.high, a.model.c[0])}; }
INLINE Lanes reach(const Bounded& a) { return largest(away(a.model)); }
INLINE Lanes fourth(Lanes x) { return x * x * (x * x); }

// 1 / x; its fourth derivative is 24 / |x|^5 in size.
inline Bounded inverse(const Bounded& a, Undefined& undefined) {
    const Lanes near = nearest_to_zero(hull(a)), f = 1.0 / a.model.c[0];
    undefined.where(~(nearest_to_zero(a.range) > 0.0));
    const Model model = series(a.model, f, -f * f, f * f * f, -f * f * (f * f), fourth(reach(a)) / (fourth(near) * near));
    return bounded(model, outward({1.0 / a.range.high, 1.0 / a.range.low}), undefined);
}

// sqrt x: by its series, with a fourth derivative of 15 / 16 x^-3.5 in size; or by the chord between a and b, sqrt a
// = p, sqrt b = q: sqrt x - (x + p q) / (p + q) lies between 0 and (q - p)^2 / (4 (p + q)). The closer one.
inline Bounded root(const Bounded& a, Undefined& undefined) {
    undefined.where(~(a.range.low >= 0.0));
    const Lanes low = most(a.range.low, nothing()), p = root(low), q = root(a.range.high), x = a.model.c[0], f = root(x);
    const Lanes sum = p + q, wide = (q - p) * (q - p) / (4.0 * sum);
    Model chord = p * q / sum + (1.0 / sum) * a.model, flat = constant(0.5 * wide);
    flat.rest = 0.5 * wide;
    chord = chord + flat;
    slack(chord, q);
    const Lanes nearest = hull(a).low, remainder = 5.0 / 128.0 * fourth(reach(a)) / (nearest * nearest * nearest * root(nearest));
    const Model near = series(a.model, f, 0.5 / f, -0.125 / (x * f), 0.0625 / (x * x * f), remainder);
    return bounded(chosen(near.rest < chord.rest, near, chord), outward({p, q}), undefined);
}

// |x| where its sign changes between -a and b: from x (b - a) / (b + a) it is between 0 and 2 a b / (b + a) away.
inline Bounded absolute(const Bounded& a, Undefined& undefined) {
    const Lanes down = -a.range.low, up = a.range.high, sum = up + down, wide = 2.0 * (down * up) / sum;
    Model chord = (up - down) / sum * a.model, flat = constant(0.5 * wide);
    flat.rest = 0.5 * wide;
    chord = chord + flat;
    slack(chord, wide + largest(a.model));
    const Model model = chosen(a.range.low >= 0.0, a.model, chosen(a.range.high <= 0.0, -a.model, chord));
    return bounded(model, {nearest_to_zero(a.range), farthest_from_zero(a.range)}, undefined);
}

// The larger of two: (a + b + |a - b|) / 2 where they cross.
inline Bounded larger(const Bounded& a, const Bounded& b, Undefined& undefined) {
    const Mask first = a.range.low >= b.range.high, second = b.range.low >= a.range.high;
    const Bounded apart = absolute(plus(a, negated(b), undefined), undefined);
    const Model crossing = 0.5 * (a.model + b.model + apart.model);
    return bounded(chosen(first, a.model, chosen(second, b.model, crossing)),
                   {most(a.range.low, b.range.low), most(a.range.high, b.range.high)}, undefined);
}

// asin x: its fourth derivative, (9 x + 6 x^3) (1 - x^2)^-3.5, grows with |x|.
inline Bounded arcsine(const Bounded& a, Undefined& undefined) {
    undefined.where(~((a.range.low >= -1.0) & (a.range.high <= 1.0)));
    const auto of = [](double x) { return std::asin(x); };
    const Lanes x = a.model.c[0], left = (1.0 - x) * (1.0 + x), f = root(1.0 / left), cube = f * f * f;
    const Lanes far = farthest_from_zero(hull(a)), least_left = (1.0 - far) * (1.0 + far), g = root(1.0 / least_left);
    const Lanes remainder = fourth(reach(a)) * (far * (9.0 + 6.0 * far * far) / 24.0) * (fourth(g) * (g * g * g));
    const Model model = series(a.model, each(x, of), f, 0.5 * x * cube, (1.0 + 2.0 * x * x) / 6.0 * (cube * f * f),
                               remainder * (1.0 + 1e-6));
    return bounded(chosen(far < 0.999, model, constant(unbounded())),
                   outward({each(a.range.low, of), each(a.range.high, of)}), undefined);
}

// atan x: its fourth derivative, 24 x (1 - x^2) / (1 + x^2)^4, is less than 24 * 0.26 in size.
inline Bounded arctangent(const Bounded& a, Undefined& undefined) {
    const auto of = [](double x) { return std::atan(x); };
    const Lanes x = a.model.c[0], f = 1.0 / (1.0 + x * x), cube = f * f * f;
    Model model = series(a.model, each(x, of), f, -x * (f * f), (x * x - 1.0 / 3.0) * cube, 0.26 * fourth(reach(a)));
    slack(model, reach(a) * reach(a) * reach(a));  // where that difference is next to nothing
    return bounded(model, outward({each(a.range.low, of), each(a.range.high, of)}), undefined);
}

// e^x; its derivatives are itself.
inline Bounded exponential(const Bounded& a, Undefined& undefined) {
    const auto of = [](double x) { return std::exp(x); };
    const Lanes f = each(a.model.c[0], of), high = each(hull(a).high, of);
    const Model model = series(a.model, f, f, 0.5 * f, 1.0 / 6.0 * f, high * fourth(reach(a)) * (1.01 / 24.0));
    return bounded(model, outward({each(a.range.low, of), each(a.range.high, of)}), undefined);
}

// log x; its fourth derivative is 6 / x^4 in size.
inline Bounded logarithm(const Bounded& a, Undefined& undefined) {
    const auto of = [](double x) { return std::log(x); };
    undefined.where(~(a.range.low > 0.0));
    const Lanes x = a.model.c[0], f = 1.0 / x, remainder = 0.2501 * fourth(reach(a)) / fourth(most(hull(a).low, nothing()));
    const Model model = series(a.model, each(x, of), f, -0.5 * f * f, 1.0 / 3.0 * f * f * f, remainder);
    return bounded(model, outward({each(a.range.low, of), each(a.range.high, of)}), undefined);
}

INLINE Bounded wave(const Bounded& a, bool is_sine, Undefined& undefined) {
    Model sine, cosine;
    sine_cosine(a.model, sine, cosine);
    Bounded found = bounded(is_sine ? sine : cosine, {all(-1.0), all(1.0)}, undefined);
    found.range = {most(found.range.low, all(-1.0)), least(found.range.high, all(1.0))};
    return found;
}

// atan2, from its value where both are in the middle on: the angle from there is atan of (x0 y - y0 x) / (x0 x + y0 y).
// To the left of 0 it may jump by a turn.
inline Bounded angle(const Bounded& y, const Bounded& x, Undefined& undefined) {
    Lanes x0 = x.model.c[0], y0 = y.model.c[0], middle;
    const Range sideways = hull(y);
    const Mask jumps = ~((hull(x).low > 0.0) | (sideways.low > 0.0) | (sideways.high < 0.0));
    for (int lane = 0; lane < LANES; ++lane) middle[lane] = std::atan2(y0[lane], x0[lane]);
    const Model across = x0 * y.model - y0 * x.model, along = x0 * x.model + y0 * y.model;
    Undefined beside;
    const Bounded ahead = input(along, beside);
    beside.where(~(ahead.range.low > 0.0));
    const Bounded turned = arctangent(times(input(across, beside), inverse(ahead, beside), beside), beside);
    Model model = middle + turned.model;
    slack(model, all(4.0));
    const Mask unknown = jumps | beside.cells;
    for (Lanes& c : model.c) c = chosen(unknown, nothing(), c);
    model.rest = chosen(unknown, all(4.0), model.rest);
    return bounded(model, {all(-3.1415926535897936), all(3.1415926535897936)}, undefined);
}

}  // namespace core
