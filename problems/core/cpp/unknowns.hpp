// What a linear program is told of, and its unknowns: control points of a spline, and tau.
#pragma once
#include <algorithm>

#include "banded.hpp"

namespace core {

// What core_program() is called with: rows of one joint, rows of all joints, bounds of the points, costs.
struct Given {
    int k, n, m1;
    const int *joint, *first;
    const double *weights, *by_time, *bound;
    int m2;
    const int* first2;
    const double *weights2, *by_time2, *bound2, *price2, *lower, *upper, *cost;
    double tau_cost;
};

// The unknowns in Lanes; tau begins the last.
struct Box {
    int count, tau;  // unknowns of control points, index of tau
    Vector lower, upper;

    Box(const Given& given, double tau_lower, double tau_upper)
        : count(given.n * given.k), tau(eights(count) * LANES), lower(tau / LANES + 1), upper(lower) {
        for (int i = 0; i < count; ++i) set(i, given.lower[i], given.upper[i]);
        set(tau, tau_lower, tau_upper);
    }

    void set(int i, double from, double to) {
        lower[i / LANES][i % LANES] = from;
        upper[i / LANES][i % LANES] = to;
    }
    double low(int i) const { return lower[i / LANES][i % LANES]; }
    double high(int i) const { return upper[i / LANES][i % LANES]; }

    // No room for an interior: the unknown is a constant.
    bool fixed(int i) const { return high(i) - low(i) <= 1e-12; }
    bool empty() const {
        for (int i = 0; i <= tau; ++i)
            if (!(low(i) <= high(i))) return true;
        return false;
    }

    // The point nearest to value that keeps a share of the width from both bounds.
    double inside(int i, double value, double share) const {
        if (fixed(i)) return low(i);
        const double margin = share * std::min(high(i) - low(i), 1.0);
        return std::max(low(i) + margin, std::min(high(i) - margin, value));
    }
};

}  // namespace core
