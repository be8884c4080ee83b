// What Python calls of expressions: their values in states, and proofs of bounds on them for every time of a motion.
#include "bisection.hpp"
#include "expression.hpp"
#include "reader.hpp"

namespace core {
namespace {

Expression expression_of(Reader reader) {
    Expression found;
    Arm& arm = found.arm;
    arm.joints.resize(reader.count());
    found.orders = reader.count(), found.moves = reader.count() != 0, found.has_hand = reader.count() != 0;
    reader.fill(arm.base_rotation, 9);
    reader.fill(arm.base_translation, 3);
    for (Joint& joint : arm.joints) joint = joint_of(reader);
    reader.fill(arm.tool_rotation, 9);
    arm.places.resize(reader.count());
    for (Place& place : arm.places) {
        place.body = reader.count();
        reader.fill(place.point, 3);
    }
    found.constants = reader.list(reader.count());
    found.sources.resize(reader.count());
    for (Source& source : found.sources) source.quantity = reader.count(), source.number = reader.count();
    found.instructions.resize(reader.count());
    for (Instruction& step : found.instructions)
        step.operation = reader.count(), step.one = reader.count(), step.two = reader.count();
    found.outputs.resize(reader.count());
    for (int& output : found.outputs) output = reader.count();
    return found;
}

// Shares of bounds (m,) each, an infinite one being none: 1 + (value - upper) / scale, 1 + (lower - value) / scale.
class WithinBounds {
public:
    WithinBounds(const Expression& expression, double duration, const double* lower, const double* upper,
                 const double* scale)
        : m_((int)expression.outputs.size()), duration_(duration), lower_(lower), upper_(upper), scale_(scale),
          numbers_(expression), bounds_(expression) {}

    Lanes seen(const State<Lanes>& state) {
        Numbers arithmetic;
        numbers_.compute(state, duration_, arithmetic);
        Largest share;
        for (int i = 0; i < m_; ++i)
            for (int side : {0, 1})
                if (std::isfinite(bound(i, side))) share.add(1.0 + excess(numbers_.output(i), i, side) / scale_[i]);
        return share.value();
    }

    Lanes bound(const State<Model>& state, Lanes& where) {
        Bounds arithmetic;
        bounds_.compute(state, duration_, arithmetic);
        Largest share, farthest;
        for (int i = 0; i < m_; ++i) {
            const Bounded& value = bounds_.output(i);
            for (int side : {0, 1}) {
                if (!std::isfinite(bound(i, side))) continue;
                const Lanes end = side ? value.range.high : value.range.low;
                const Lanes off = ROUNDED * (size(end) + std::abs(bound(i, side)) + scale_[i]);
                share.add(1.0 + (excess(end, i, side) + off) / scale_[i]);
                const Model own = side ? value.model : -value.model;
                where = chosen(farthest.add((top(own) - (side ? upper_[i] : -lower_[i])) / scale_[i]), likely(own), where);
            }
        }
        return chosen(arithmetic.undefined.cells, unbounded(), share.value());
    }

private:
    double bound(int i, int side) const { return side ? upper_[i] : lower_[i]; }
    Lanes excess(Lanes value, int i, int side) const { return side ? value - upper_[i] : lower_[i] - value; }

    const int m_;
    const double duration_, *lower_, *upper_, *scale_;
    Values<Lanes, Numbers> numbers_;
    Values<Model, Bounds> bounds_;
};

}  // namespace
}  // namespace core

using namespace core;

extern "C" {

Expression* core_expression(const long long* counts, const double* numbers) {
    return new Expression(expression_of({counts, numbers}));
}

void core_forget_expression(Expression* expression) { delete expression; }

// Values (rows, m) in states (rows, 4 k + 1): joints and three derivatives, time.
void core_expression_values(const Expression* expression, int rows, const double* states, double duration, double* values) {
    const int k = (int)expression->arm.joints.size(), width = ORDERS * k + 1, m = (int)expression->outputs.size();
    Values<Lanes, Numbers> computed(*expression);
    Numbers arithmetic;
    State<Lanes> state;
    for (int row = 0; row < rows; row += LANES) {
        const int count = gathered(states, rows, row, width, state.joints);
        state.time = state.joints.back();
        computed.compute(state, duration, arithmetic);
        for (int lane = 0; lane < count; ++lane)
            for (int i = 0; i < m; ++i) values[(size_t)(row + lane) * m + i] = computed.output(i)[lane];
    }
}

// How they change with angles, velocities and accelerations, as far as they depend on them: (rows, m, 3, k).
void core_expression_slopes(const Expression* expression, int rows, const double* states, double duration, double* slopes) {
    const int k = (int)expression->arm.joints.size(), width = ORDERS * k + 1, m = (int)expression->outputs.size();
    const int known = std::min(expression->orders, 3) * k;
    Values<Sloped, Slopes> computed(*expression);
    Slopes arithmetic;
    std::vector<Lanes> lanes;
    State<Sloped> state;
    state.joints.resize(width);
    for (int row = 0; row < rows; row += LANES) {
        const int count = gathered(states, rows, row, width, lanes);
        for (int j = 0; j < width; ++j) state.joints[j] = {lanes[j], Lanes{}};
        state.time = state.joints.back();
        for (int by = 0; by < known; ++by) {
            state.joints[by].slope = all(1.0);
            computed.compute(state, duration, arithmetic);
            state.joints[by].slope = Lanes{};
            for (int lane = 0; lane < count; ++lane)
                for (int i = 0; i < m; ++i)
                    slopes[((size_t)(row + lane) * m + i) * 3 * k + by] = computed.output(i).slope[lane];
        }
    }
}

// Whether values stay between bounds, as in `Found`; moments are pieces and offsets, (n,). Written are the largest share
// and the time of that, s, seen from its own piece, and a cell.
int core_prove_expression(const Expression* expression, int pieces, int order, const double* breaks,
                          const double* coefficients, const double* lower, const double* upper, const double* scale,
                          double allowed, int first_cells, long long most_cells, double step, int n, const int* at_pieces,
                          const double* offsets, double* found) {
    Polynomials polynomials({pieces, order, breaks, coefficients}, (int)expression->arm.joints.size(), expression->orders);
    WithinBounds question(*expression, breaks[pieces], lower, upper, scale);
    std::vector<Moment> moments;
    for (int i = 0; i < n; ++i) moments.push_back({at_pieces[i], offsets[i]});
    const Found result = Bisection<WithinBounds>(polynomials, question, {allowed, HUGE_VAL, 1.0, first_cells, most_cells})(moments, step);
    const int piece = result.moment.piece;
    const double time = breaks[piece] + result.moment.offset, end = breaks[piece + 1];
    found[0] = result.share, found[1] = std::min(time, piece + 1 < pieces ? std::nextafter(end, 0.0) : end);
    found[2] = result.start, found[3] = result.end;
    return result.status;
}
}
