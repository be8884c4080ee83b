// A convex program whose unknowns are the control points x of a spline (n points of k joints) and one number tau:
//
//     minimise  f(y) + sum of price * sigma    subject to    G y - sigma <= h,  sigma >= 0,  lower <= y <= upper,
//
// where y = (x, tau) and f(y) = tau_cost tau + cost x + half a sum of weighted squares of rows; a linear program where
// there are none of these. A row of G reaches REACH consecutive control points, of one joint or of all, and tau. Hard
// rows have no sigma. Bounds of y are rows of G too from here on.
//
// Mehrotra's predictor-corrector method with slacks s >= 0 and multipliers z >= 0, where v = price - z >= 0 belongs to
// sigma. Newton's step towards s z = q and sigma v = p solves, with D = 1 / (s / z + sigma / v) and f's derivatives,
//
//     (f'' + G'DG) dy = -(f' + G'z) - G'D e,    e = G y - h + q / z - p / v,    dz = D (G dy + e),
//     dsigma = (p + sigma dz) / v - sigma,    ds = dsigma - G dy - (G y + s - sigma - h).
//
// The predictor has q = p = 0. The corrector has q = mu - ds dz and p = mu + dsigma dz with the predictor's steps;
// mu is the mean product times the cube of the share that the predictor leaves of it. Gondzio's correctors follow while
// steps are short: the factor is what costs most, and they use it again.
//
// Where f is linear, unknowns and multipliers go steps of their own lengths; else of the same, which keeps f' + G'z
// shrinking. f'' + G'DG is banded in x and has a border for tau.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "squares.hpp"

namespace core {

constexpr int MOST_ITERATIONS = 60;
constexpr double ERROR = 1e-8;                         // of rows and of stationarity
constexpr double GAP = 1e-7;                           // against the cost, which counts as 0.1 to 1
constexpr double INSIDE = 1e-10;                       // share of a width that solutions keep from bounds
constexpr double FIRST_SLACK = 0.3, FIRST_MU = 0.1;
constexpr double NEARLY_ALL = 0.995;                   // of the way to the nearest bound

constexpr int CORRECTORS = 2;
constexpr double NEAREST = 0.1, FARTHEST = 10.0;       // products, against mu
constexpr double LONG = 0.95;                          // a step that needs no corrector
constexpr double LONGER = 0.2, WORTHWHILE = 0.02;      // what a corrector aims to gain, what it has to

struct Step {
    Vector y, along;         // along: G y
    Vector s, z, sigma, v;
    double primal, dual;     // shares of it that keep s and sigma, and z and v, positive
};

// The share of a step that takes the first of these values to zero, or 1. In lanes of hard rows 0 / 0 is not greater.
inline double share(const Vector& step, const Vector& values) {
    const double *down = (const double*)step.data(), *from = (const double*)values.data();
    Doubles worst = {};
    for (size_t i = 0; i < values.size() * LANES; i += WIDTH) {
        const Doubles ratio = -*(const Doubles*)(down + i) / *(const Doubles*)(from + i);
        worst = chosen(ratio > worst, ratio, worst);
    }
    double result = 1.0;
    for (int lane = 0; lane < WIDTH; ++lane) result = std::max(result, worst[lane]);
    return 1.0 / result;
}

INLINE Lanes correction(Lanes product, double mu) {
    return most(least(most(product, all(NEAREST * mu)), all(FARTHEST * mu)) - product, all(-FARTHEST * mu));
}

template <int REACH>
class Solver {
public:
    Solver(const Given& given, const Given& squared, const Box& box)
        : given(given), box(box), rows(given, box), squares(squared, box), matrix(rows.tiles(), rows.depth()), slots(rows.slots), soft(rows.soft),
          y(rows.tiles() + 1), dual(y), s(slots), z(s), sigma(soft), v(sigma), excess(s), weight(s), e(s), q(s),
          p(sigma), step{y, s, s, s, sigma, sigma, 0.0, 0.0}, trial(step) {}

    double value(int i) const { return y[i / LANES][i % LANES]; }

    // How many iterations it took, or 0.
    int solve() {
        start();
        for (int iteration = 1; iteration <= MOST_ITERATIONS; ++iteration) {
            const double error = residual(), gap = complement(0.0, 0.0);
            if (!(error < 1e100 && gap < 1e100)) return 0;
            if (error <= ERROR && gap <= GAP * std::max(0.1, std::min(std::abs(cost()), 1.0))) return iteration;
            weigh();
            std::fill(q.begin(), q.end(), Lanes{});
            std::fill(p.begin(), p.end(), Lanes{});
            find(step);
            const double left = complement(step.primal, step.dual) / gap, mu = left * left * left * gap / products;
            aim(mu);
            find(step);
            correct(mu);
            advance();
        }
        return 0;
    }

private:
    const Given& given;
    const Box& box;
    Rows<REACH> rows;
    Squares<REACH> squares;
    Banded matrix;
    int slots, soft;
    double products = 0.0;            // how many pairs s z and sigma v there are
    Vector y, dual;                   // dual: f' + G'z
    Vector s, z, sigma, v;            // the last two in soft slots only, with sigma = 0 and v = 1 in hard lanes
    Vector excess, weight, e, q, p;   // G y - h, D and what the formulas above call so
    Step step, trial;

    // All products are the same. Bounds and soft rows hold exactly, hard rows have slacks of some size.
    void start() {
        for (int i = 0; i <= box.tau; ++i) y[i / LANES][i % LANES] = box.inside(i, 0.0, 0.1);
        rows.apply(y, excess);
        products = slots * LANES;
        for (int i = 0; i < slots; ++i) {
            excess[i] -= rows.bound[i];
            s[i] = most(-excess[i], all(i < rows.bounds ? FIRST_SLACK : 0.0));
            z[i] = FIRST_MU / s[i];
        }
        for (int i = 0; i < soft; ++i) {
            for (int lane = 0; lane < LANES; ++lane) {
                const double price = rows.price[i][lane], room = -excess[i][lane];
                v[i][lane] = 1.0;
                sigma[i][lane] = 0.0;
                if (price == 0.0) continue;
                // s - sigma = room, s z = sigma (price - z) = mu
                const double least = FIRST_MU / price, root = std::sqrt(0.25 * room * room + least * least);
                const double above = room > 0.0 ? root + 0.5 * room : least * least / (root - 0.5 * room);
                s[i][lane] = least + above;
                z[i][lane] = FIRST_MU / s[i][lane];
                v[i][lane] = price * above / s[i][lane];
                sigma[i][lane] = FIRST_MU / v[i][lane];
                products += 1.0;
            }
        }
    }

    // Sum of all products after shares of the step.
    double complement(double of_primal, double of_dual) const {
        Lanes total = {};
        for (int i = 0; i < slots; ++i) total += (s[i] + of_primal * step.s[i]) * (z[i] + of_dual * step.z[i]);
        for (int i = 0; i < soft; ++i) total += (sigma[i] + of_primal * step.sigma[i]) * (v[i] + of_dual * step.v[i]);
        return sum(total);
    }

    // The greatest error of a row and of the stationarity.
    double residual() {
        rows.transpose(z, dual);
        dual[rows.tiles()][0] += box.fixed(box.tau) ? 0.0 : given.tau_cost;
        if (given.cost)
            for (int i = 0; i < box.count; ++i) dual[i / LANES][i % LANES] += box.fixed(i) ? 0.0 : given.cost[i];
        squares.add_gradient(y, dual);
        Lanes worst = {};
        for (const Lanes& d : dual) worst = most(worst, size(d));
        for (int i = 0; i < slots; ++i)
            worst = most(worst, size(i < soft ? excess[i] + s[i] - sigma[i] : excess[i] + s[i]));
        return greatest(worst);
    }

    double cost() const {
        Lanes total = {};
        for (int i = 0; i < soft; ++i) total += rows.price[i] * sigma[i];
        double along = 0.0;
        if (given.cost)
            for (int i = 0; i < box.count; ++i) along += given.cost[i] * value(i);
        return given.tau_cost * y[rows.tiles()][0] + along + sum(total) + (squares.none ? 0.0 : squares.value());
    }

    void weigh() {
        for (int i = 0; i < slots; ++i) weight[i] = i < soft ? 1.0 / (s[i] / z[i] + sigma[i] / v[i]) : z[i] / s[i];
        squares.begin(matrix);
        rows.weigh(weight, matrix);
        matrix.factor();
    }

    // Newton's step towards s z = q and sigma v = p.
    void find(Step& step) {
        for (int i = 0; i < slots; ++i) {
            e[i] = excess[i] + q[i] / z[i];
            if (i < soft) e[i] -= p[i] / v[i];
            step.z[i] = weight[i] * e[i];
        }
        rows.transpose(step.z, step.y);
        for (size_t i = 0; i < y.size(); ++i) step.y[i] = -(dual[i] + step.y[i]);
        matrix.solve(step.y);
        rows.apply(step.y, step.along);
        for (int i = 0; i < slots; ++i) {
            step.z[i] = weight[i] * (step.along[i] + e[i]);
            step.s[i] = -(step.along[i] + excess[i] + s[i]);
            if (i >= soft) continue;
            const Lanes moved = (p[i] + sigma[i] * step.z[i]) / v[i];
            step.sigma[i] = moved - sigma[i];
            step.v[i] = chosen(rows.price[i] > 0.0, -step.z[i], Lanes{});
            step.s[i] += moved;
        }
        measure(step);
    }

    void measure(Step& step) const {
        step.primal = std::min(share(step.s, s), share(step.sigma, sigma));
        step.dual = std::min(share(step.z, z), share(step.v, v));
    }

    // At products mu, less what a step like the predictor adds in the second order.
    void aim(double mu) {
        for (int i = 0; i < slots; ++i) q[i] = mu - step.s[i] * step.z[i];
        for (int i = 0; i < soft; ++i) p[i] = chosen(rows.price[i] > 0.0, mu - step.sigma[i] * step.v[i], Lanes{});
    }

    // Gondzio's correctors: products that a longer step would leave far from mu are aimed at the edge of what is near.
    // The factor serves once more.
    void correct(double mu) {
        for (int count = 0; count < CORRECTORS && std::min(step.primal, step.dual) < LONG; ++count) {
            const double primal = std::min(1.0, step.primal + LONGER), dual = std::min(1.0, step.dual + LONGER);
            for (int i = 0; i < slots; ++i)
                q[i] += correction((s[i] + primal * step.s[i]) * (z[i] + dual * step.z[i]), mu);
            for (int i = 0; i < soft; ++i) {
                const Lanes product = (sigma[i] + primal * step.sigma[i]) * (v[i] + dual * step.v[i]);
                p[i] += chosen(rows.price[i] > 0.0, correction(product, mu), Lanes{});
            }
            find(trial);
            if (trial.primal + trial.dual < step.primal + step.dual + WORTHWHILE) return;
            std::swap(step, trial);
        }
    }

    void advance() {
        double primal = std::min(1.0, NEARLY_ALL * step.primal), dual = std::min(1.0, NEARLY_ALL * step.dual);
        if (!squares.none) primal = dual = std::min(primal, dual);
        for (size_t i = 0; i < y.size(); ++i) y[i] += primal * step.y[i];
        for (int i = 0; i < slots; ++i) {
            excess[i] += primal * step.along[i];
            s[i] += primal * step.s[i];
            z[i] += dual * step.z[i];
        }
        for (int i = 0; i < soft; ++i) {
            sigma[i] += primal * step.sigma[i];
            v[i] += dual * step.v[i];
        }
    }
};

}  // namespace core
