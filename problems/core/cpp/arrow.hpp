// A symmetric matrix in the shape of an arrow, and equations of it: one band for each joint, a border of columns that all
// joints share, and a corner. Joints are lanes: those of one group take the same steps. The corner of the first columns
// is negative definite: they are multipliers of rows in which joints come together.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "banded.hpp"

namespace core {

constexpr double FIRST_SHIFT = 1e-4, SHIFT_GROWTH = 3.0, LARGEST_SHIFT = 1e12;
constexpr double NO_PIVOT = 1e-14;  // of the corner, as a share of what it was

class Arrow {
public:
    Vector right;                      // of the bands: the right-hand side, then the solution, (size, groups)
    std::vector<double> corner, last;  // (columns, columns), of which what lies above the diagonal is not read; (columns,)

    // Entries of a row reach `reach` columns back. A border column is zero before the row where it begins.
    Arrow(int size, int reach, int groups, int negative, std::vector<int> begins)
        : right(size * groups), corner(begins.size() * begins.size()), last(begins.size()), size(size), reach(reach),
          groups(groups), negative(negative), columns((int)begins.size()), begins(std::move(begins)),
          bands(size * (reach + 1) * groups), border(columns * size * groups), inverse(size * groups) {}

    void clear() {
        for (Vector* each : {&bands, &border, &right}) std::fill(each->begin(), each->end(), Lanes{});
        std::fill(corner.begin(), corner.end(), 0.0);
        std::fill(last.begin(), last.end(), 0.0);
    }

    Lanes& at(int row, int column, int g) { return bands[(row * (reach + 1) + row - column) * groups + g]; }
    Lanes& side(int column, int row, int g) { return border[(column * size + row) * groups + g]; }
    double& corner_at(int row, int column) { return corner[row * columns + column]; }

    // An unknown that gets no step in the lanes of a group where `moves` is 0, and not 1.
    void fix(int unknown, int g, const Lanes& moves) {
        for (int other = std::max(0, unknown - reach); other < unknown; ++other) at(unknown, other, g) *= moves;
        for (int other = unknown; other <= std::min(size - 1, unknown + reach); ++other) at(other, unknown, g) *= moves;
        at(unknown, unknown, g) += 1.0 - moves;
        right[unknown * groups + g] *= moves;
        for (int b = 0; b < columns; ++b) side(b, unknown, g) *= moves;
    }

    // Whether there is a solution; the rest of the corner is shifted, but for its last column, until it is positive.
    bool solve() {
        factor();
        for (int b = 0; b < columns; ++b) forward(&border[b * size * groups], begins[b]);
        forward(right.data(), 0);
        std::vector<double> schur(corner);
        for (int b = 0; b < columns; ++b) {
            for (int c = 0; c <= b; ++c) schur[b * columns + c] -= product(b, &border[c * size * groups], begins[c]);
            last[b] -= product(b, right.data(), 0);
        }
        if (!solve_corner(schur)) return false;
        for (int b = 0; b < columns; ++b)
            for (int j = begins[b] * groups; j < size * groups; ++j) right[j] -= border[b * size * groups + j] * last[b];
        backward(right.data());
        return true;
    }

private:
    const int size, reach, groups, negative, columns;
    const std::vector<int> begins;
    Vector bands, border, inverse;  // the last of the pivots

    double product(int column, const Lanes* other, int begin) const {
        const Lanes* own = &border[column * size * groups];
        Lanes found{};
        for (int j = std::max(begins[column], begin) * groups; j < size * groups; ++j) found += own[j] * other[j];
        return sum(found);
    }

    void factor() {
        for (int row = 0; row < size; ++row)
            for (int column = std::max(0, row - reach); column <= row; ++column)
                for (int g = 0; g < groups; ++g) {
                    Lanes& value = at(row, column, g);
                    for (int d = std::max(0, row - reach); d < column; ++d) value -= at(row, d, g) * at(column, d, g);
                    if (row == column) {
                        value = root(chosen(value > 1e-200, value, all(1e200)));
                        inverse[row * groups + g] = 1.0 / value;
                    } else {
                        value *= inverse[column * groups + g];
                    }
                }
    }

    void forward(Lanes* y, int begin) {
        for (int row = begin; row < size; ++row)
            for (int g = 0; g < groups; ++g) {
                Lanes value = y[row * groups + g];
                for (int d = std::max(begin, row - reach); d < row; ++d) value -= at(row, d, g) * y[d * groups + g];
                y[row * groups + g] = value * inverse[row * groups + g];
            }
    }

    void backward(Lanes* y) {
        for (int row = size - 1; row >= 0; --row)
            for (int g = 0; g < groups; ++g) {
                Lanes value = y[row * groups + g];
                for (int d = row + 1; d <= std::min(size - 1, row + reach); ++d)
                    value -= at(d, row, g) * y[d * groups + g];
                y[row * groups + g] = value * inverse[row * groups + g];
            }
    }

    bool solve_corner(const std::vector<double>& matrix) {
        std::vector<double> l;
        double shift = 0.0;
        while (!factored(l = matrix, shift)) {
            shift = shift == 0.0 ? FIRST_SHIFT : SHIFT_GROWTH * shift;
            if (!(shift < LARGEST_SHIFT)) return false;
        }
        for (int b = 0; b < columns; ++b) {
            for (int c = 0; c < b; ++c) last[b] -= l[b * columns + c] * last[c];
            last[b] /= l[b * columns + b];
        }
        for (int b = 0; b < negative; ++b) last[b] = -last[b];
        for (int b = columns - 1; b >= 0; --b) {
            for (int c = b + 1; c < columns; ++c) last[b] -= l[c * columns + b] * last[c];
            last[b] /= l[b * columns + b];
        }
        return true;
    }

    // The factor L of L diag(-1, .., 1, ..) L' of a matrix in its place; whether it has one.
    bool factored(std::vector<double>& l, double shift) const {
        for (int b = 0; b < columns; ++b)
            for (int c = 0; c <= b; ++c) {
                double &value = l[b * columns + c], *one = &l[b * columns], *other = &l[c * columns];
                const double before = std::abs(value);
                if (b == c && b >= negative && b < columns - 1) value += shift;
                for (int d = 0; d < std::min(c, negative); ++d) value += one[d] * other[d];
                for (int d = negative; d < c; ++d) value -= one[d] * other[d];
                if (c < negative) value = -value;
                if (b > c) value /= other[c];
                else if (value > NO_PIVOT * before && std::isfinite(value)) value = std::sqrt(value);
                else return false;
            }
        return true;
    }
};

}  // namespace core
