// A motion whose joints are polynomials of time; in cells, as Taylor models; at single times, as numbers.
//
// The cells of a piece are its halves, halved again: number k of level l has the half length h = L 2^-(l + 1) and the
// middle m = (2 k + 1) h, where L is no less than the piece is long. A polynomial of degree d about m, by Horner's scheme,
// and the powers of h take no more than 3 d + 4 roundings between a coefficient and the result; m is off by u m, which
// changes it by d u of the sizes of its terms. 8 (d + 4) u times these sizes at m + h is more than both together.
#pragma once
#include <algorithm>
#include <vector>

#include "models.hpp"

namespace core {

struct Motion {
    int pieces, order;           // polynomials, and their number of coefficients
    const double* breaks;        // pieces + 1, s
    const double* coefficients;  // order, pieces, joints; the highest power first, of the time since the piece began
};

constexpr int ORDERS = 4;  // angles, speeds, accelerations, jerks

struct Moment {
    int piece;
    double offset;  // s, since the piece began
};

struct Cell {
    int piece, level;
    double number;
};

// Joints and their derivatives, (orders, k), and the time, of eight cells or moments.
template <class T>
struct State {
    std::vector<T> joints;
    T time;
};

class Polynomials {
public:
    Polynomials(const Motion& motion, int joints, int orders)
        : motion(motion), joints(joints), orders(orders), around_(motion.order), sizes_(motion.order) {}

    double half(const Cell& cell) const {
        const double length = motion.breaks[cell.piece + 1] - motion.breaks[cell.piece];
        return std::ldexp(std::nextafter(length, HUGE_VAL), -cell.level - 1);
    }
    double middle(const Cell& cell) const { return (2.0 * cell.number + 1.0) * half(cell); }
    Moment moment(const Cell& cell, double share) const {
        return {cell.piece, middle(cell) + share * half(cell)};
    }
    double start(int piece) const { return motion.breaks[piece]; }

    void at(const Moment* moments, State<Lanes>& state) {
        Lanes offset, begin;
        for (int lane = 0; lane < LANES; ++lane)
            pieces_[lane] = moments[lane].piece, offset[lane] = moments[lane].offset, begin[lane] = start(moments[lane].piece);
        state.joints.resize((size_t)orders * joints);
        for (int j = 0; j < joints; ++j) {
            gather(j);
            shift(around_, offset);
            double factor = 1.0;
            for (int r = 0; r < orders; factor *= ++r)
                state.joints[r * joints + j] = r < motion.order ? factor * around_[r] : nothing();
        }
        state.time = begin + offset;
    }

    void over(const Cell* cells, State<Model>& state) {
        Lanes m, h, begin;
        for (int lane = 0; lane < LANES; ++lane) {
            pieces_[lane] = cells[lane].piece, begin[lane] = start(cells[lane].piece);
            m[lane] = middle(cells[lane]), h[lane] = half(cells[lane]);
        }
        state.joints.resize((size_t)orders * joints);
        const double rounding = 8.0 * (motion.order + 3) * UNIT;
        for (int j = 0; j < joints; ++j) {
            gather(j);
            for (int i = 0; i < motion.order; ++i) sizes_[i] = size(around_[i]);
            shift(around_, m);
            shift(sizes_, m + h);
            double factor = 1.0;
            for (int r = 0; r < orders; factor *= ++r) {
                Model& model = state.joints[r * joints + j] = constant(nothing());
                if (r >= motion.order) continue;
                double factors = factor;  // (p + r)! / p!
                Lanes power = all(1.0);
                for (int p = 0; p + r < motion.order; ++p, power *= h) {
                    const Lanes term = factors * around_[p + r] * power;
                    if (p <= DEGREE) model.c[p] = term;
                    else model.rest += size(term);
                    factors = factors * (p + 1 + r) / (p + 1);
                }
                model.rest += rounding * (factor * sizes_[r] + model.rest);
            }
        }
        state.time = constant(begin + m);
        state.time.c[1] = h;
        slack(state.time, size(begin) + m + h);
    }

    const Motion motion;
    const int joints, orders;

private:
    void gather(int joint) {
        for (int i = 0; i < motion.order; ++i)
            for (int lane = 0; lane < LANES; ++lane)
                around_[i][lane] = motion.coefficients[((size_t)(motion.order - 1 - i) * motion.pieces + pieces_[lane]) * joints + joint];
    }

    // Coefficients, lowest power first, about another middle.
    void shift(std::vector<Lanes>& c, Lanes by) const {
        const int degree = motion.order - 1;
        for (int i = 0; i < std::min(degree, motion.order); ++i)
            for (int j = degree - 1; j >= i; --j) c[j] += by * c[j + 1];
    }

    int pieces_[LANES];
    std::vector<Lanes> around_, sizes_;
};

}  // namespace core
