// Half the sum of weights times squares of what rows are away from their bounds, w (G y - h)^2 / 2: a part of what a
// program minimises. Its second derivatives G'WG are banded as those of the other rows are, and the same at every step.
#pragma once
#include "rows.hpp"

namespace core {

template <int REACH>
class Squares {
public:
    bool none;

    // The rows are those of all joints, their prices the weights.
    Squares(const Given& given, const Box& box)
        : none(given.m2 == 0), rows(given, box), second(rows.tiles(), rows.depth()), weight(rows.slots), away(weight),
          gradient(rows.tiles() + 1) {
        for (int i = 0; i < rows.soft; ++i) weight[i] = rows.price[i];
        if (!none) rows.weigh(weight, second);
    }

    // Second derivatives, and nothing else, in a matrix.
    void begin(Banded& matrix) const {
        if (none) matrix.clear();
        else matrix = second;
    }

    // Adds first derivatives at y to others.
    void add_gradient(const Vector& y, Vector& others) {
        if (none) return;
        rows.apply(y, away);
        for (int i = 0; i < rows.slots; ++i) away[i] = weight[i] * (away[i] - rows.bound[i]);
        rows.transpose(away, gradient);
        for (size_t i = 0; i < others.size(); ++i) others[i] += gradient[i];
    }

    // At the y of the last gradient.
    double value() const {
        Lanes total = {};
        for (int i = 0; i < rows.soft; ++i)
            for (int lane = 0; lane < LANES; ++lane)
                if (weight[i][lane] > 0.0) total[lane] += 0.5 * away[i][lane] * away[i][lane] / weight[i][lane];
        return sum(total);
    }

private:
    Rows<REACH> rows;
    Banded second;
    Vector weight, away, gradient;  // away: times the weights
};

}  // namespace core
