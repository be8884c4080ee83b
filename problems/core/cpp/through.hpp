// The least time through given postures: durations T_i of segments, rates at the places between them, control points.
//
// Segment i is a clamped spline of degree D of N cells in u = t / T_i. Its first and last D control points follow from
// the places and the derivatives q_e (e < D) there, which neighbours share: they are P + sum of phi_e q_e T^e, so that
// any values are a motion through all places. The others are free. All count from the segment's first place, so that
// rounding is small where places are near each other. With tau = log T the program is
//
//     minimise  sum of T / sum of T_0 + price * sigma    subject to    |w c| <= (1 + sigma) b(T),  sigma >= 0,
//
// where a row w of a derivative of order r is a share of its limit and b = (T / T_ref)^r. It is solved by a primal-dual
// interior-point method with slacks s of their own: with D = z / s and y = mu / s + D (g + s) of rows g <= 0 of slopes G,
//
//     (H + G'DG) d = -(f' + G'y),    ds = -(g + s) - G d,    dz = mu / s - z - D ds.
//
// Products q_e T^e are curved. What a straight step misses of them would lie in one cell and cost N^2 of the highest
// derivative, so that steps are bent: the miss is added along a smooth spline phi_e. H is the exact second derivative
// along bent steps. A step is as long as it lowers f - mu sum of log s, or what slacks miss.
//
// Where a place is at the end of a joint's range, the joint can only turn back there: its speed stays zero. Rows keep the
// angles next to it within the range; an acceleration of a solution that leads out of it stays zero from then on.
//
// A guard is a row of all joints and the duration of a segment, h = a'c + b (tau - log T_0) >= l - sigma: what a distance
// or a torque is to the first order. It would fill the bands. Its part D h'h'^T of the equations is instead a border
// column, h'^T d - lambda / D = 0, that adds lambda h'.
#pragma once
#include <algorithm>
#include <array>
#include <numeric>

#include "arrow.hpp"

namespace core {

// A row of every segment: a derivative of an order, by D + 1 control points from the first on.
struct PointRow {
    int order, first;
};

// Places (S + 1, k), limits of the derivatives (D, k), derivatives at both ends (2, D - 1, k), and whether a joint is at
// the upper end of its range at a place, 1, at the lower, -1, or at none, 0, (S + 1, k). A limit that is not finite is none.
struct Stops {
    int segments, joints;
    const double *places, *limits, *ends, *turns;
};

// Rows (m), those of angles last, their weights (S, m, D + 1), phi_e of all K = N + D control points, (S, 2 ends, D - 1,
// K), and the middles and halves of the ranges of angles, (S, rows of angles, 2, k).
struct Cells {
    int count;
    double price;
    std::vector<PointRow> rows;
    const double *weights, *bends, *ranges;

    int angles() const {
        return (int)std::count_if(rows.begin(), rows.end(), [](const PointRow& row) { return row.order == 0; });
    }
};

// Guards (count,): segments, first control points, slopes by D + 1 of these (count, D + 1, k), slopes by tau, least h.
struct Guards {
    int count;
    const int *segments, *first;
    const double *slopes, *by_tau, *least;
};

// Most take less than 150; past 40 places near a line, some of them near each other, more than 1,000.
constexpr int THROUGH_ITERATIONS = 400, SEGMENT_ITERATIONS = 80;
constexpr double FIRST_PRODUCTS = 0.03, LAST_PRODUCTS = 3e-4;  // sums of s z
constexpr double STATIONARITY = 3e-3, VIOLATION = 1e-3;
constexpr double CENTERING = 0.1, TO_BOUNDARY = 0.99;
constexpr double LARGEST_TAU = 0.4, LEAST_SLACK = 1e-3;
constexpr double ENOUGH_DESCENT = 1e-4, SHORTEST_STEP = 1e-8, MOST_MISSED = 1e3;

template <int D>
class Through {
public:
    static constexpr int E = D - 1, REACH = 2 * D - 2;  // rates of a place; how far unknowns of a row are apart

    Through(const Stops& stops, const Cells& cells, const Guards& guards)
        : stops(stops), cells(cells), guards(guards), N(cells.count), K(N + D), S(stops.segments),
          G(eights(stops.joints)), m((int)cells.rows.size()), A(cells.angles()), n(S * (N - 1) + E), slots(S * m * G),
          C(guards.count), places((S + 1) * G), slopes(C * (D + 1) * G), mask(slots), scale(slots), value(slots), held(C),
          now(empty()), trial(empty()), z{value, value}, ds(z), dz(z), zc(C), dsc(C), dzc(C), dual(n * G), unit(n * G),
          moves(n * G), system(n, REACH, G, C, begins()) {
        for (int lane = 0; lane < stops.joints; ++lane) {
            for (int i = 0; i <= S; ++i) at(places, i * G * LANES + lane) = stops.places[i * stops.joints + lane];
            for (int j = 0; j < C * (D + 1); ++j) at(slopes, j * G * LANES + lane) = guards.slopes[j * stops.joints + lane];
        }
    }

    // Rates at the places between, (S - 1, D - 1, k), free control points (S, N - D, k) and durations (S,), all of which
    // are replaced. Whether they are a solution.
    bool operator()(double* rates, double* inner, double* durations) {
        visit(rates, inner, [](Lanes& own, int lane, double& given) { own[lane] = given; });
        std::copy(durations, durations + S, now.T.begin());
        start();
        bool solved = false;
        for (int iteration = 0; goes_on(iteration) && linearise() && !solved; ++iteration) {
            solved = gap() < LAST_PRODUCTS && stationarity() < STATIONARITY && violation() < VIOLATION;
            if (solved && hold_outward()) solved = false;
            else if (!solved && !(system.solve() && advance())) break;
        }
        visit(rates, inner, [](Lanes& own, int lane, double& given) { given = own[lane]; });
        std::copy(now.T.begin(), now.T.end(), durations);
        return solved;
    }

private:
    // Whether there are iterations left: more of them where durations are shorter by now than at first.
    bool goes_on(int iteration) const {
        if (iteration < THROUGH_ITERATIONS) return true;
        double now_in_all = 0.0;
        for (double T : now.T) now_in_all += T;
        return now_in_all < total && iteration < THROUGH_ITERATIONS + SEGMENT_ITERATIONS * S;
    }

    typedef std::array<Vector, 2> Sides;  // upper bounds, lower bounds

    // Unknowns (n, G): rates of a place, then free control points behind it, and so on; the first and last are given.
    struct State {
        Vector u;
        std::vector<double> T;
        double sigma;
        Sides s;
        std::vector<double> bounds;  // b of each order, (S, D + 1)
        std::vector<double> sc;      // slacks of guards
    };

    const Stops& stops;
    const Cells& cells;
    const Guards& guards;
    const int N, K, S, G, m, A, n, slots, C;  // A rows of angles; a slot is a row of a segment and a group; C guards
    Vector places, slopes;
    Vector mask, scale;                 // 1 where there is a limit, else 0; 1 / (limit T_ref^r)
    Vector value;                       // of the rows of the state that was evaluated last, as shares of limits
    std::vector<double> held;           // h of its guards
    State now, trial;
    Sides z, ds, dz;
    std::vector<double> zc, dsc, dzc;   // of guards
    Vector dual, unit;                  // f' + G'z; what divides it
    Vector moves;                       // 1 where an unknown may change, else 0, (n, G)
    Arrow system;
    std::vector<double> reference;      // T_ref
    double products = 1.0, total = 0.0, mu = 0.0, zeta = 0.0, dual_sigma = 0.0, worst_tau = 0.0;

    static double& at(Vector& values, int number) { return ((double*)values.data())[number]; }
    State empty() const {
        return {Vector(n * G), std::vector<double>(S), 0.0, {Vector(slots), Vector(slots)},
                std::vector<double>(S * (D + 1)), std::vector<double>(C)};
    }

    // Border columns are those of guards, of durations, and of sigma. All but the last begin with their segments.
    int column_of(int segment) const { return C + segment; }
    std::vector<int> begins() const {
        std::vector<int> found(C + S + 1);
        for (int j = 0; j < C; ++j) found[j] = base(guards.segments[j]);
        for (int i = 0; i < S; ++i) found[column_of(i)] = base(i);
        return found;
    }

    // The unknown where the rates of a place begin. Control point p of the segment behind it is unknown base + p - 1.
    int base(int segment) const { return segment * (N - 1); }

    int slot_of(int segment, int row, int g) const { return (segment * m + row) * G + g; }
    const double* weights(int segment, int row) const { return cells.weights + (segment * m + row) * (D + 1); }

    // Calls with each slot, its segment and its row.
    template <class Visit>
    void each_slot(Visit&& visit) const {
        for (int i = 0; i < S; ++i)
            for (int r = 0; r < m; ++r)
                for (int g = 0; g < G; ++g) visit(slot_of(i, r, g), i, cells.rows[r].order);
    }

    // Calls with each guard of a segment, the control points that it knows, and its slope by these.
    template <class Visit>
    void each_guard_point(int segment, int g, Visit&& visit) const {
        for (int j = 0; j < C; ++j)
            for (int a = 0; a <= D && guards.segments[j] == segment; ++a)
                visit(j, guards.first[j] + a, slopes[(j * (D + 1) + a) * G + g]);
    }

    double bend(int segment, int end, int e, int point) const {
        return cells.bends[((segment * 2 + end) * E + e - 1) * K + point];
    }

    double bound(int segment, int order, const State& state) const { return state.bounds[segment * (D + 1) + order]; }

    // g = |w c| - (1 + sigma) b of a bound b, and what its slack misses.
    Lanes excess(int slot, int side, double bound, const State& state) const {
        return (side ? -value[slot] : value[slot]) - (1.0 + state.sigma) * bound;
    }
    Lanes missed(int slot, int side, double bound, const State& state) const {
        return mask[slot] * (excess(slot, side, bound, state) + state.s[side][slot]);
    }
    double guard_excess(int j, const State& state) const { return guards.least[j] - held[j] - state.sigma; }
    double guard_missed(int j, const State& state) const { return guard_excess(j, state) + state.sc[j]; }

    // The unknowns of a control point: number, factor, and by which power of T the factor grows.
    template <class Visit>
    void unknowns_of(int segment, int point, double T, Visit&& visit) const {
        const int end = point >= K - D, near = end ? K - 1 - point : point;
        if (near >= D) return visit(base(segment) + point - 1, 1.0, 0);
        double power = T;
        for (int e = 1; e <= near; ++e, power *= T)
            visit(base(segment + end) + e - 1, bend(segment, end, e, point) * power, e);
    }

    // Pairs an unknown, and its lane, with the number that Python knows.
    template <class Pair>
    void visit(double* rates, double* inner, Pair&& pair) {
        const int k = stops.joints, free = K - 2 * D;
        for (int lane = 0; lane < k; ++lane)
            for (int i = 0; i <= S; ++i) {
                const auto own = [&](int unknown) -> Lanes& { return now.u[unknown * G + lane / LANES]; };
                for (int e = 0; e < E; ++e) {
                    double given = stops.ends[((i == S) * E + e) * k + lane];
                    pair(own(base(i) + e), lane % LANES, i > 0 && i < S ? rates[((i - 1) * E + e) * k + lane] : given);
                }
                for (int p = 0; p < free && i < S; ++p)
                    pair(own(base(i) + D + p - 1), lane % LANES, inner[(i * free + p) * k + lane]);
            }
    }

    // What may change: neither the rates at both ends, nor the speed of a joint at the end of its range.
    void find_what_moves() {
        for (int u = 0; u < n; ++u)
            for (int g = 0; g < G; ++g) moves[u * G + g] = all(u < E || u >= n - E ? 0.0 : 1.0);
        for (int i = 1; i < S; ++i)
            for (int joint = 0; joint < stops.joints; ++joint)
                if (turn_of(i, joint) != 0.0) hold(i, 0, joint);
    }

    double turn_of(int place, int joint) const { return stops.turns[place * stops.joints + joint]; }

    void hold(int place, int rate, int joint) {
        const int unknown = (base(place) + rate) * G + joint / LANES;
        moves[unknown][joint % LANES] = now.u[unknown][joint % LANES] = 0.0;
    }

    // Holds at zero the accelerations that lead out of the range where a joint is at its end; whether there are any.
    bool hold_outward() {
        bool found = false;
        for (int i = 1; i < S && E > 1; ++i)
            for (int joint = 0; joint < stops.joints; ++joint) {
                const int unknown = base(i) * G + joint / LANES, lane = joint % LANES;
                if (!(now.u[unknown + G][lane] * turn_of(i, joint) > 0.0)) continue;
                hold(i, 1, joint);
                found = true;
            }
        return found;
    }

    void start() {
        find_what_moves();
        reference = now.T;
        for (int i = 0; i < S; ++i) total += now.T[i];
        for (int i = 0; i < S; ++i)
            for (int r = 0; r < m; ++r)
                for (int g = 0; g < G; ++g) {
                    const int slot = slot_of(i, r, g), order = cells.rows[r].order;
                    scale[slot] = order ? inverse_limit(i, order, g, mask[slot]) : inverse(range(i, r, 1), g, 1.0, mask[slot]);
                }
        for (int u = 0; u < n; ++u) {
            const int i = std::min(u / (N - 1), S - 1), e = u - base(i) + 1;
            for (int g = 0; g < G; ++g) {
                Lanes known{};
                const Lanes found = inverse_limit(i, e <= E ? e : 1, g, known) * (e <= E ? std::pow(reference[i], e) : N);
                unit[u * G + g] = chosen(known > 0.0, found, all(1.0));
            }
        }
        products += C;
        for (const Lanes& each : mask) products += 2.0 * sum(each);
        evaluate(now);
        mu = FIRST_PRODUCTS / products;
        now.sigma = std::max(mu / cells.price, violation());
        zeta = mu / now.sigma;
        each_slot([&](int slot, int i, int order) {
            for (int side : {0, 1}) {
                now.s[side][slot] = most(-excess(slot, side, bound(i, order, now), now), all(LEAST_SLACK));
                z[side][slot] = mask[slot] * mu / now.s[side][slot];
            }
        });
        for (int j = 0; j < C; ++j) now.sc[j] = std::max(-guard_excess(j, now), LEAST_SLACK), zc[j] = mu / now.sc[j];
    }

    // 1 / (limit T^r) of the joints of a group, and 1 where there is a limit.
    Lanes inverse_limit(int segment, int order, int g, Lanes& known) const {
        return inverse(stops.limits + (order - 1) * stops.joints, g, std::pow(reference[segment], order), known);
    }

    Lanes inverse(const double* limits, int g, double unit, Lanes& known) const {
        Lanes found{};
        for (int lane = 0; lane < LANES && g * LANES + lane < stops.joints; ++lane) {
            const double limit = limits[g * LANES + lane];
            known[lane] = std::isfinite(limit);
            if (std::isfinite(limit)) found[lane] = 1.0 / (limit * unit);
        }
        return found;
    }

    // Middles of the ranges of a row of angles, or their halves, (k,).
    const double* range(int segment, int row, int which) const {
        return cells.ranges + ((segment * A + row - (m - A)) * 2 + which) * stops.joints;
    }
    Lanes middle(int segment, int row, int g) const {
        Lanes found{};
        for (int lane = 0; lane < LANES && g * LANES + lane < stops.joints; ++lane)
            found[lane] = range(segment, row, 0)[g * LANES + lane];
        return found;
    }

    void evaluate(State& state) {
        std::vector<Lanes> c(K);
        std::fill(held.begin(), held.end(), 0.0);
        for (int i = 0; i < S; ++i) {
            double* b = &state.bounds[i * (D + 1)];
            b[0] = 1.0;
            for (int r = 1; r <= D; ++r) b[r] = b[r - 1] * state.T[i] / reference[i];
            for (int g = 0; g < G; ++g) {
                for (int p = 0; p < K; ++p) {
                    c[p] = p >= K - D ? places[(i + 1) * G + g] - places[i * G + g] : Lanes{};
                    unknowns_of(i, p, state.T[i], [&](int u, double by, int) { c[p] += by * state.u[u * G + g]; });
                }
                for (int r = 0; r < m; ++r) {
                    const int slot = slot_of(i, r, g);
                    const Lanes from = cells.rows[r].order == 0 ? middle(i, r, g) - places[i * G + g] : Lanes{};
                    value[slot] = (sum_of(i, r, c) - from) * scale[slot];
                }
                each_guard_point(i, g, [&](int j, int p, Lanes slope) { held[j] += sum(slope * c[p]); });
            }
            for (int j = 0; j < C; ++j)
                if (guards.segments[j] == i) held[j] += guards.by_tau[j] * std::log(state.T[i] / reference[i]);
        }
    }

    Lanes sum_of(int segment, int row, const std::vector<Lanes>& points) const {
        const Lanes* from = &points[cells.rows[row].first];
        const double* w = weights(segment, row);
        Lanes found{};
        for (int a = 0; a <= D; ++a) found += w[a] * from[a];
        return found;
    }

    double gap() const {
        Lanes found{};
        for (int side : {0, 1})
            for (int slot = 0; slot < slots; ++slot) found += z[side][slot] * now.s[side][slot];
        return sum(found) + std::inner_product(zc.begin(), zc.end(), now.sc.begin(), now.sigma * zeta);
    }

    // The largest excess over bounds, as a share of these.
    double violation() const {
        Lanes worst{};
        each_slot([&](int slot, int i, int order) {
            worst = most(worst, mask[slot] * (size(value[slot]) / bound(i, order, now) - 1.0));
        });
        double found = greatest(worst);
        for (int j = 0; j < C; ++j) found = std::max(found, guards.least[j] - held[j]);
        return found;
    }

    // The largest derivative that is left, by unknowns in the units of limits and durations.
    double stationarity() const {
        double worst = std::max(worst_tau, std::abs(dual_sigma));
        for (int u = E; u < n - E; ++u)
            for (int g = 0; g < G; ++g)
                worst = std::max(worst, greatest(moves[u * G + g] * size(dual[u * G + g]) / unit[u * G + g]));
        return worst;
    }

    // The equations of the next step; whether they are of numbers.
    bool linearise() {
        evaluate(now);
        mu = CENTERING * gap() / products;
        system.clear();
        std::fill(dual.begin(), dual.end(), Lanes{});
        dual_sigma = cells.price - zeta, worst_tau = 0.0;
        for (int i = 0; i < S; ++i) {
            const int column = column_of(i);
            system.corner_at(column, column) += now.T[i] / total;
            system.last[column] -= now.T[i] / total;
            double dual_tau = now.T[i] / total;
            for (int g = 0; g < G; ++g) dual_tau += linearise(i, g);
            for (int j = 0; j < C; ++j) {
                if (guards.segments[j] != i) continue;
                system.corner_at(column, j) -= guards.by_tau[j];
                system.last[column] += guards.by_tau[j] * guard_weight(j), dual_tau -= guards.by_tau[j] * zc[j];
            }
            worst_tau = std::max(worst_tau, std::abs(dual_tau));
        }
        const int last = column_of(S);
        system.corner_at(last, last) += zeta / now.sigma;
        system.last[last] -= cells.price - mu / now.sigma;
        for (int j = 0; j < C; ++j) {
            system.corner_at(j, j) = -now.sc[j] / zc[j], system.corner_at(last, j) = -1.0;
            system.last[last] += guard_weight(j), dual_sigma -= zc[j];
        }
        for (int u = 0; u < n; ++u)
            for (int g = 0; g < G; ++g)
                if (sum(moves[u * G + g]) < LANES) system.fix(u, g, moves[u * G + g]);
        return std::isfinite(mu) && std::isfinite(stationarity());
    }

    // y of a guard.
    double guard_weight(int j) const { return mu / now.sc[j] + zc[j] / now.sc[j] * guard_missed(j, now); }

    // Sums over the rows of a segment, of one group: of control points, then of its duration and sigma.
    struct Sums {
        std::vector<Lanes> square, by_bound, by_slack, first, multiplier;
        Lanes tt{}, ts{}, ss{}, t{}, s{}, dual_t{}, dual_s{};
    };

    Sums summed(int i, int g) const {
        const std::vector<Lanes> none(K, Lanes{});
        Sums sums{std::vector<Lanes>(K * (D + 1), Lanes{}), none, none, none, none};
        for (int r = 0; r < m; ++r) {
            const int slot = slot_of(i, r, g), order = cells.rows[r].order, from = cells.rows[r].first;
            const double b = bound(i, order, now), slope = order * b * (1.0 + now.sigma), *w = weights(i, r);
            Lanes weight[2], y[2];
            for (int side : {0, 1}) {
                weight[side] = z[side][slot] / now.s[side][slot];
                y[side] = mask[slot] * mu / now.s[side][slot] + weight[side] * missed(slot, side, b, now);
            }
            const Lanes both = weight[0] + weight[1], turns = z[0][slot] + z[1][slot];
            sums.tt += both * (slope * slope) - turns * (order * slope);
            sums.ts += both * (slope * b) - turns * (order * b), sums.ss += both * (b * b);
            sums.t -= slope * (y[0] + y[1]), sums.s -= b * (y[0] + y[1]);
            sums.dual_t -= slope * turns, sums.dual_s -= b * turns;
            const Lanes share = scale[slot], first = (y[0] - y[1]) * share, multiplier = (z[0][slot] - z[1][slot]) * share;
            const Lanes other = (weight[1] - weight[0]) * share, square = both * share * share;
            for (int a = 0; a <= D; ++a) {
                const int p = from + a;
                sums.first[p] += w[a] * first, sums.multiplier[p] += w[a] * multiplier;
                sums.by_slack[p] += (w[a] * b) * other, sums.by_bound[p] += (w[a] * slope) * other;
                for (int c = 0; c <= a; ++c) sums.square[p * (D + 1) + a - c] += (w[a] * w[c]) * square;
            }
        }
        each_guard_point(i, g, [&](int j, int p, Lanes slope) {
            sums.first[p] -= guard_weight(j) * slope, sums.multiplier[p] -= zc[j] * slope;
        });
        return sums;
    }

    // Adds a segment, of one group, to the equations; its part of the derivative by tau of f + z'g.
    double linearise(int i, int g) {
        const double T = now.T[i];
        const int column = column_of(i), last = column_of(S);
        Sums sums = summed(i, g);
        std::vector<Lanes> turn(K, Lanes{}), turned(sums.by_bound);  // turn: of control points with tau
        for (int p = 0; p < K; ++p)
            unknowns_of(i, p, T, [&](int u, double by, int e) { turn[p] += (e * by) * now.u[u * G + g]; });
        for (int p = 0; p < K; ++p)
            for (int q = std::max(0, p - D); q <= std::min(K - 1, p + D); ++q) turned[p] += square_of(sums, p, q) * turn[q];
        for (int p = 0; p < K; ++p) {
            sums.tt += turn[p] * (turned[p] + sums.by_bound[p]);
            sums.ts += turn[p] * sums.by_slack[p], sums.t += turn[p] * sums.first[p];
            sums.dual_t += turn[p] * sums.multiplier[p];
            unknowns_of(i, p, T, [&](int u, double by, int) {
                system.right[u * G + g] -= by * sums.first[p], dual[u * G + g] += by * sums.multiplier[p];
                system.side(column, u, g) += by * turned[p], system.side(last, u, g) += by * sums.by_slack[p];
                for (int q = std::max(0, p - D); q <= std::min(K - 1, p + D); ++q)
                    unknowns_of(i, q, T, [&](int v, double other, int) {
                        if (v <= u) system.at(u, v, g) += (by * other) * square_of(sums, p, q);
                    });
            });
        }
        each_guard_point(i, g, [&](int j, int p, Lanes slope) {
            unknowns_of(i, p, T, [&](int u, double by, int) { system.side(j, u, g) -= by * slope; });
            system.corner_at(column, j) -= sum(turn[p] * slope);
        });
        system.corner_at(column, column) += sum(sums.tt + curved(i, g, sums.multiplier));
        system.corner_at(last, column) += sum(sums.ts), system.corner_at(last, last) += sum(sums.ss);
        system.last[column] -= sum(sums.t), system.last[last] -= sum(sums.s);
        dual_sigma += sum(sums.dual_s);
        return sum(sums.dual_t);
    }

    static Lanes square_of(const Sums& sums, int p, int q) {
        return sums.square[std::max(p, q) * (D + 1) + std::abs(p - q)];
    }

    // Second derivatives along bent steps: by rates and tau, which go to the border, and by tau alone.
    Lanes curved(int i, int g, const std::vector<Lanes>& multiplier) {
        Lanes found{};
        double power = now.T[i];
        for (int e = 1; e <= E; ++e, power *= now.T[i])
            for (int end : {0, 1}) {
                Lanes by{};
                for (int p = 0; p < K; ++p) by += bend(i, end, e, p) * multiplier[p];
                const int rate = base(i + end) + e - 1;
                system.side(column_of(i), rate, g) += (e * power) * by;
                found += (e * e * power) * by * now.u[rate * G + g];
            }
        return found;
    }

    // One step; whether there is one.
    bool advance() {
        const double* tau = &system.last[C];
        const double dzeta = mu / now.sigma - zeta - zeta / now.sigma * tau[S];
        step_sides();
        double primal = shares(now.s, ds, TO_BOUNDARY), dual_share = shares(z, dz, TO_BOUNDARY);
        primal = shortened(primal, now.sigma, tau[S]), dual_share = shortened(dual_share, zeta, dzeta);
        for (int j = 0; j < C; ++j)
            primal = shortened(primal, now.sc[j], dsc[j]), dual_share = shortened(dual_share, zc[j], dzc[j]);
        for (int i = 0; i < S; ++i) primal = std::min(primal, LARGEST_TAU / std::max(std::abs(tau[i]), LARGEST_TAU));
        const double before = merit(now), missing = missed(now), slope = std::min(merit_slope(), 0.0);
        for (double share = primal; share > SHORTEST_STEP; share *= 0.5) {
            bend_to(share);
            const double enough = ENOUGH_DESCENT * share, left = missed(trial);
            const bool is_lower = merit(trial) <= before + enough * slope + 1e-12 * std::abs(before);
            if (!(left < MOST_MISSED && (is_lower || left <= (1.0 - enough) * missing))) continue;
            std::swap(now, trial);
            for (int side : {0, 1})
                for (int slot = 0; slot < slots; ++slot) z[side][slot] += dual_share * dz[side][slot];
            zeta += dual_share * dzeta;
            for (int j = 0; j < C; ++j) zc[j] += dual_share * dzc[j];
            return true;
        }
        return false;
    }

    // Steps of slacks and multipliers.
    void step_sides() {
        std::vector<Lanes> moved(K);
        const double* tau = &system.last[C];
        for (int i = 0; i < S; ++i)
            for (int g = 0; g < G; ++g) {
                for (int p = 0; p < K; ++p) {
                    moved[p] = Lanes{};
                    unknowns_of(i, p, now.T[i], [&](int u, double by, int e) {
                        moved[p] += by * (system.right[u * G + g] + (e * tau[i]) * now.u[u * G + g]);
                    });
                }
                for (int r = 0; r < m; ++r) {
                    const int slot = slot_of(i, r, g), order = cells.rows[r].order;
                    const Lanes along = sum_of(i, r, moved) * scale[slot];
                    const double b = bound(i, order, now);
                    const double more = b * (order * (1.0 + now.sigma) * tau[i] + tau[S]);
                    for (int side : {0, 1}) {
                        const Lanes s = now.s[side][slot], own = z[side][slot];
                        const Lanes change = more - (side ? -along : along) - missed(slot, side, b, now);
                        ds[side][slot] = mask[slot] * change;
                        dz[side][slot] = mask[slot] * (mu / s) - own - own / s * change;
                    }
                }
            }
        for (int j = 0; j < C; ++j) {
            dsc[j] = -guard_missed(j, now) - system.last[j] * now.sc[j] / zc[j];
            dzc[j] = mu / now.sc[j] - zc[j] - zc[j] / now.sc[j] * dsc[j];
        }
    }

    static double shortened(double share, double from, double change) {
        return change < 0.0 ? std::min(share, -TO_BOUNDARY * from / change) : share;
    }

    // The share of steps that keeps values positive, of those that count.
    double shares(const Sides& values, const Sides& steps, double share) const {
        for (int side : {0, 1})
            for (int slot = 0; slot < slots; ++slot)
                for (int lane = 0; lane < LANES; ++lane)
                    if (mask[slot][lane] > 0.0)
                        share = shortened(share, values[side][slot][lane], steps[side][slot][lane]);
        return share;
    }

    // The trial state at a share of the step, bent.
    void bend_to(double share) {
        for (int j = 0; j < n * G; ++j) trial.u[j] = now.u[j] + share * system.right[j];
        trial.sigma = now.sigma + share * system.last[column_of(S)];
        for (int i = 0; i < S; ++i) {
            const double change = share * system.last[column_of(i)], T = now.T[i];
            trial.T[i] = T * std::exp(change);
            double power = T, later = trial.T[i];
            for (int e = 1; e <= E; ++e, power *= T, later *= trial.T[i])
                for (int end : {0, 1})
                    for (int g = 0; g < G; ++g) {
                        const int rate = (base(i + end) + e - 1) * G + g;
                        const Lanes straight = power * (now.u[rate] * (1.0 + e * change) + share * system.right[rate]);
                        const Lanes rest = trial.u[rate] * later - straight;
                        for (int p = D; p < K - D; ++p) trial.u[(base(i) + p - 1) * G + g] += rest * bend(i, end, e, p);
                    }
        }
        evaluate(trial);
        each_slot([&](int slot, int i, int order) {
            for (int side : {0, 1}) {
                const Lanes straight = now.s[side][slot] + share * ds[side][slot];
                trial.s[side][slot] = most(straight, -excess(slot, side, bound(i, order, trial), trial));
            }
        });
        for (int j = 0; j < C; ++j) trial.sc[j] = std::max(now.sc[j] + share * dsc[j], -guard_excess(j, trial));
    }

    // What slacks miss, in all, of the state that was evaluated last.
    double missed(const State& state) const {
        Lanes found{};
        each_slot([&](int slot, int i, int order) {
            for (int side : {0, 1}) found += size(missed(slot, side, bound(i, order, state), state));
        });
        double guarded = 0.0;
        for (int j = 0; j < C; ++j) guarded += std::abs(guard_missed(j, state));
        return sum(found) + guarded;
    }

    double merit(const State& state) const {
        double found = cells.price * state.sigma - mu * std::log(state.sigma);
        for (int i = 0; i < S; ++i) found += state.T[i] / total;
        for (double each : state.sc) found -= mu * std::log(each);
        for (int slot = 0; slot < slots; ++slot)
            for (int lane = 0; lane < LANES; ++lane)
                if (mask[slot][lane] > 0.0) found -= mu * std::log(state.s[0][slot][lane] * state.s[1][slot][lane]);
        return found;
    }

    double merit_slope() const {
        const double* tau = &system.last[C];
        double found = (cells.price - mu / now.sigma) * tau[S];
        for (int i = 0; i < S; ++i) found += now.T[i] / total * tau[i];
        for (int j = 0; j < C; ++j) found -= mu * dsc[j] / now.sc[j];
        Lanes barrier{};
        for (int side : {0, 1})
            for (int slot = 0; slot < slots; ++slot) barrier += ds[side][slot] / now.s[side][slot];
        return found - mu * sum(barrier);
    }
};

}  // namespace core
