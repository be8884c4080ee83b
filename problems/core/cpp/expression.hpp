// Expressions of one instant: what a hand does, and operations on that, of numbers or of Taylor models.
#pragma once
#include <algorithm>
#include <vector>

#include "bounded.hpp"
#include "motion.hpp"
#include "newton_euler.hpp"

namespace core {

// A point of a body; that of the tool is the first, and its body carries the tool.
struct Place {
    int body;
    double point[3];
};

struct Arm {
    double base_rotation[9], base_translation[3];
    std::vector<Joint> joints;
    double tool_rotation[9];  // in the frame of its body
    std::vector<Place> places;
};

// Frames, places and the tool's velocity, in the world.
template <class T>
class Hand {
public:
    explicit Hand(const Arm& arm) : arm(arm), frames(arm.joints.size() + 1), ways(arm.joints.size()) {
        for (int body = carrier(); body > 0; body = arm.joints[body - 1].parent) moving.push_back(body - 1);
        std::reverse(moving.begin(), moving.end());
    }

    // Of angles and speeds, k of each after the other.
    void place(const T* q, bool moves) {
        const int k = (int)arm.joints.size();
        const T none = 0.0 * q[0];
        Pose<T>& base = frames[0];
        for (int i = 0; i < 9; ++i) base.rotation[i] = arm.base_rotation[i] + none;
        const double* p = arm.base_translation;
        base.translation = {p[0] + none, p[1] + none, p[2] + none};
        for (int i = 0; i < k; ++i) {
            const Joint& joint = arm.joints[i];
            const Pose<T>&before = frames[joint.parent], own = pose_of(joint, q[i]);
            Pose<T>& after = frames[i + 1];
            ways[i] = before.turned(own.translation);
            after.translation = before.translation + ways[i];
            for (int row = 0; row < 9; row += 3)
                for (int column = 0; column < 3; ++column)
                    after.rotation[row + column] = before.rotation[row] * own.rotation[column] +
                                                   before.rotation[row + 1] * own.rotation[3 + column] +
                                                   before.rotation[row + 2] * own.rotation[6 + column];
        }
        Triple<T> rate = {none, none, none};
        velocity = rate;
        if (!moves) return;
        for (const int i : moving) {
            const Joint& joint = arm.joints[i];
            velocity = velocity + cross(rate, ways[i]);
            const Triple<T> along = frames[i + 1].turned(scaled(joint.axis, q[k + i]));
            if (joint.turns) rate = rate + along;
            else velocity = velocity + along;
        }
        velocity = velocity + cross(rate, turned(frames[carrier()], arm.places[0].point));
    }

    T coordinate(int number) const {
        const Place& place = arm.places[number / 3];
        const Pose<T>& frame = frames[place.body];
        const Triple<T>& origin = frame.translation;
        const int row = number % 3;
        return (row == 0 ? origin.x : row == 1 ? origin.y : origin.z) + along(frame, row, place.point);
    }
    T rotation(int number) const {
        const double* tool = arm.tool_rotation + number % 3;
        const double column[3] = {tool[0], tool[3], tool[6]};
        return along(frames[carrier()], number / 3, column);
    }
    T speed(int number) const { return number == 0 ? velocity.x : number == 1 ? velocity.y : velocity.z; }

private:
    int carrier() const { return arm.places[0].body; }
    static T along(const Pose<T>& frame, int row, const double* v) {
        const T* r = frame.rotation + 3 * row;
        return v[0] * r[0] + v[1] * r[1] + v[2] * r[2];
    }
    static Triple<T> turned(const Pose<T>& frame, const double* v) {
        return {along(frame, 0, v), along(frame, 1, v), along(frame, 2, v)};
    }

    const Arm& arm;
    std::vector<Pose<T>> frames;
    std::vector<Triple<T>> ways;  // from the body that each joint is on to its own frame
    std::vector<int> moving;      // joints that move the tool, from the base on
    Triple<T> velocity;
};

enum Quantity { JOINTS, TIME, DURATION, PLACE, VELOCITY, ROTATION };  // by derivative and joint, by place and coordinate

// In the order of problems/core/expressions.py.
enum Operation { ADD, SUB, MUL, DIV, FMIN, FMAX, ATAN2, NEG, SQ, TWICE, INV, SQRT, FABS, SIN, COS, ASIN, ACOS, ATAN, EXP, LOG };

struct Instruction {
    int operation, one, two;
};

struct Source {
    int quantity, number;
};

struct Expression {
    Arm arm;
    int orders;     // of derivatives that it needs
    bool moves;     // whether it needs the tool's velocity
    bool has_hand;  // or anything of the arm but its joints
    std::vector<double> constants;
    std::vector<Source> sources;
    std::vector<Instruction> instructions;
    std::vector<int> outputs;
};

struct Numbers {
    typedef Lanes Value;
    static Lanes exactly(double value) { return all(value); }
    static Lanes known(const Lanes& value) { return value; }
    template <class Function>
    static Lanes each(Lanes a, Lanes b, Function&& function) {
        for (int lane = 0; lane < LANES; ++lane) a[lane] = function(a[lane], b[lane]);
        return a;
    }
    static Lanes apply(int operation, Lanes a, Lanes b) {
        switch (operation) {
        case ADD: return a + b;
        case SUB: return a - b;
        case MUL: return a * b;
        case DIV: return a / b;
        case FMIN: return each(a, b, [](double x, double y) { return std::fmin(x, y); });
        case FMAX: return each(a, b, [](double x, double y) { return std::fmax(x, y); });
        case ATAN2: return each(a, b, [](double y, double x) { return std::atan2(y, x); });
        case NEG: return -a;
        case SQ: return a * a;
        case TWICE: return a + a;
        case INV: return 1.0 / a;
        case SQRT: return root(a);
        case FABS: return size(a);
        case SIN: return each(a, a, [](double x, double) { return std::sin(x); });
        case COS: return each(a, a, [](double x, double) { return std::cos(x); });
        case ASIN: return each(a, a, [](double x, double) { return std::asin(x); });
        case ACOS: return each(a, a, [](double x, double) { return std::acos(x); });
        case ATAN: return each(a, a, [](double x, double) { return std::atan(x); });
        case EXP: return each(a, a, [](double x, double) { return std::exp(x); });
        default: return each(a, a, [](double x, double) { return std::log(x); });
        }
    }
};

// Of numbers that change with one angle, velocity or acceleration.
struct Slopes {
    typedef Sloped Value;
    static Sloped exactly(double value) { return {all(value), Lanes{}}; }
    static Sloped known(const Sloped& value) { return value; }
    static Sloped apply(int operation, const Sloped& a, const Sloped& b) {
        const Lanes value = Numbers::apply(operation, a.value, b.value);
        switch (operation) {
        case ADD: return a + b;
        case SUB: return a - b;
        case MUL: return a * b;
        case DIV: return {value, (a.slope - value * b.slope) / b.value};
        case FMIN: return {value, chosen(a.value <= b.value, a.slope, b.slope)};
        case FMAX: return {value, chosen(a.value >= b.value, a.slope, b.slope)};
        case ATAN2:
            return {value, (a.slope * b.value - b.slope * a.value) / (a.value * a.value + b.value * b.value)};
        default: return {value, by_one(operation, a.value, value) * a.slope};
        }
    }

private:
    // How the value of an operation on one number changes with that.
    static Lanes by_one(int operation, const Lanes& a, const Lanes& value) {
        switch (operation) {
        case NEG: return all(-1.0);
        case SQ: return 2.0 * a;
        case TWICE: return all(2.0);
        case INV: return -(value * value);
        case SQRT: return 0.5 / value;
        case FABS: return chosen(a > 0.0, all(1.0), chosen(a < 0.0, all(-1.0), Lanes{}));
        case SIN: return Numbers::apply(COS, a, a);
        case COS: return -Numbers::apply(SIN, a, a);
        case ASIN: return 1.0 / root(1.0 - a * a);
        case ACOS: return -1.0 / root(1.0 - a * a);
        case ATAN: return 1.0 / (1.0 + a * a);
        case EXP: return value;
        default: return 1.0 / a;
        }
    }
};

struct Bounds {
    typedef Bounded Value;
    Undefined undefined;
    static Bounded exactly(double value) { return core::exactly(value); }
    Bounded known(const Model& model) { return input(model, undefined); }
    Bounded apply(int operation, const Bounded& a, const Bounded& b) {
        switch (operation) {
        case ADD: return plus(a, b, undefined);
        case SUB: return plus(a, negated(b), undefined);
        case MUL: return times(a, b, undefined);
        case DIV: return times(a, inverse(b, undefined), undefined);
        case FMIN: return negated(larger(negated(a), negated(b), undefined));
        case FMAX: return larger(a, b, undefined);
        case ATAN2: return angle(a, b, undefined);
        case NEG: return negated(a);
        case SQ: return squared(a, undefined);
        case TWICE: return plus(a, a, undefined);
        case INV: return inverse(a, undefined);
        case SQRT: return root(a, undefined);
        case FABS: return absolute(a, undefined);
        case SIN: return wave(a, true, undefined);
        case COS: return wave(a, false, undefined);
        case ASIN: return arcsine(a, undefined);
        case ACOS: return plus(exactly(1.5707963267948966), negated(arcsine(a, undefined)), undefined);
        case ATAN: return arctangent(a, undefined);
        case EXP: return exponential(a, undefined);
        default: return logarithm(a, undefined);
        }
    }
};

// The values of an expression, by the arithmetic of numbers or of bounds.
template <class T, class Arithmetic>
class Values {
public:
    explicit Values(const Expression& expression) : expression(expression), hand(expression.arm) {}

    void compute(const State<T>& state, double duration, Arithmetic& arithmetic) {
        registers.clear();
        const T* joints = state.joints.data();
        if (expression.has_hand) hand.place(joints, expression.moves);
        for (double value : expression.constants) registers.push_back(arithmetic.exactly(value));
        for (const Source& source : expression.sources) {
            const int n = source.number;
            switch (source.quantity) {
            case JOINTS: registers.push_back(arithmetic.known(joints[n])); break;
            case TIME: registers.push_back(arithmetic.known(state.time)); break;
            case DURATION: registers.push_back(arithmetic.exactly(duration)); break;
            case PLACE: registers.push_back(arithmetic.known(hand.coordinate(n))); break;
            case VELOCITY: registers.push_back(arithmetic.known(hand.speed(n))); break;
            default: registers.push_back(arithmetic.known(hand.rotation(n)));
            }
        }
        for (const Instruction& step : expression.instructions)
            registers.push_back(arithmetic.apply(step.operation, registers[step.one], registers[step.two]));
    }
    const typename Arithmetic::Value& output(int number) const { return registers[expression.outputs[number]]; }

private:
    const Expression& expression;
    Hand<T> hand;
    std::vector<typename Arithmetic::Value> registers;
};

}  // namespace core
