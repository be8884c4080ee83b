// A symmetric matrix that is banded, with a border of one row and column, and its Cholesky factor, in tiles of 8 by 8.
// Sums are formed in an order that does not depend on the instruction set.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "lanes.hpp"

namespace core {

#if defined(__clang__)
#define UNROLLED _Pragma("unroll")
#define SHUFFLED(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define UNROLLED _Pragma("GCC unroll 8")
#define SHUFFLED(a, b, ...) __builtin_shuffle(a, b, Mask{__VA_ARGS__})  // before GCC 12 the other one is not there
#endif

typedef std::vector<Lanes> Vector;

INLINE double sum(const Lanes& a) { return ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7])); }

#if defined(__AVX512F__)
// Sums of neighbours, of pairs and of fours.
INLINE Lanes pairs_1(Lanes a, Lanes b) {
    return SHUFFLED(a, b, 0, 8, 2, 10, 4, 12, 6, 14) + SHUFFLED(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
}
INLINE Lanes pairs_2(Lanes a, Lanes b) {
    return SHUFFLED(a, b, 0, 1, 8, 9, 4, 5, 12, 13) + SHUFFLED(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
}
INLINE Lanes pairs_4(Lanes a, Lanes b) {
    return SHUFFLED(a, b, 0, 1, 2, 3, 8, 9, 10, 11) + SHUFFLED(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

// In lane i, the sum of a[i]: the same additions either way.
INLINE Lanes sums(const Lanes* a) {
    return pairs_4(pairs_2(pairs_1(a[0], a[1]), pairs_1(a[2], a[3])),
                   pairs_2(pairs_1(a[4], a[5]), pairs_1(a[6], a[7])));
}
#else
INLINE Lanes sums(const Lanes* a) {
    Lanes found;
    for (int lane = 0; lane < LANES; ++lane) found[lane] = sum(a[lane]);
    return found;
}
#endif

INLINE double greatest(const Lanes& a) {
    double result = a[0];
    for (int lane = 1; lane < LANES; ++lane) result = std::max(result, a[lane]);
    return result;
}

// Adds to a tile, column c: the sum over rows r of factor[r] * left[r] * right[r][c], with rows `stride` apart.
INLINE void add_products(Lanes* tile, const Lanes* left, const Lanes* right, int stride, const double* factor,
                         int rows) {
    for (int strip = 0; strip < LANES; strip += WIDTH) {
        double* target = (double*)tile + strip;
        const double *l = (const double*)left + strip, *r = (const double*)right;
        Doubles a[LANES];
        UNROLLED for (int c = 0; c < LANES; ++c) a[c] = *(Doubles*)(target + c * LANES);
        for (int row = 0; row < rows; ++row, l += stride * LANES, r += stride * LANES) {
            const Doubles weighted = *(const Doubles*)l * factor[row];
            UNROLLED for (int c = 0; c < LANES; ++c) a[c] += weighted * r[c];
        }
        UNROLLED for (int c = 0; c < LANES; ++c) *(Doubles*)(target + c * LANES) = a[c];
    }
}

// Lane by lane, the sum of a[i] * b[i].
INLINE void multiply(const Lanes* a, const Lanes* b, int count, Lanes& result) {
    for (int strip = 0; strip < LANES; strip += WIDTH) {
        const double *left = (const double*)a + strip, *right = (const double*)b + strip;
        Doubles total = *(const Doubles*)left * *(const Doubles*)right;
        for (int i = 1; i < count; ++i) total += *(const Doubles*)(left + i * LANES) * *(const Doubles*)(right + i * LANES);
        *(Doubles*)((double*)&result + strip) = total;
    }
}

INLINE int eights(int count) { return (count + LANES - 1) / LANES; }

// A symmetric matrix of `size` tiles a side with a border of one column, and its factor L in the same place. Of each
// column of tiles the first `depth` from the diagonal down are kept; a tile is eight columns of eight rows.
class Banded {
public:
    Vector border;
    double corner = 0.0;

    Banded(int size, int depth) : border(size), size(size), depth(depth), tiles(size * depth * LANES), inverse(size) {}

    Lanes* tile(int row, int column) { return &tiles[(column * depth + row - column) * LANES]; }
    const Lanes* tile(int row, int column) const { return &tiles[(column * depth + row - column) * LANES]; }

    void clear() {
        std::fill(tiles.begin(), tiles.end(), Lanes{});
        std::fill(border.begin(), border.end(), Lanes{});
        corner = 0.0;
    }

    // What lies above the diagonal is never read.
    void add(int row, int column, double value) {
        tile(row / LANES, column / LANES)[column % LANES][row % LANES] += value;
    }

    void factor() {
        for (int column = 0; column < size; ++column) {
            factor_diagonal(column);
            for (int row = column + 1; row < std::min(column + depth, size); ++row) divide(row, column);
        }
        forward(border);
        Lanes square = {};
        for (const Lanes& b : border) square += b * b;
        corner_inverse = inverse_pivot(corner - sum(square), corner);
    }

    // From the right-hand side, whose last Lanes begins with that of the border, to the solution.
    void solve(Vector& y) const {
        forward(y);
        Lanes product = {};
        for (int i = 0; i < size; ++i) product += border[i] * y[i];
        const double last = (y[size][0] - sum(product)) * corner_inverse * corner_inverse;
        for (int i = 0; i < size; ++i) y[i] -= border[i] * last;
        y[size] = Lanes{last};
        backward(y);
    }

private:
    int size, depth;
    Vector tiles, inverse;  // of the pivots
    double corner_inverse = 0.0;

    // What cannot be told from zero belongs to a direction that no row resists: it gets no step.
    static double inverse_pivot(double pivot, double before) {
        return pivot <= 1e-15 * std::abs(before) || pivot < 1e-200 ? 0.0 : 1.0 / std::sqrt(pivot);
    }

    void subtract_products(int row, int column) {
        static constexpr double minus[LANES] = {-1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0};
        for (int before = std::max(0, row - depth + 1); before < column; ++before)
            add_products(tile(row, column), tile(row, before), tile(column, before), 1, minus, LANES);
    }

    // The factor is stored on both sides of the diagonal: backward() reads its rows where forward() reads columns.
    void factor_diagonal(int column) {
        Lanes* a = tile(column, column);
        Lanes before, inv;
        UNROLLED for (int c = 0; c < LANES; ++c) before[c] = a[c][c];
        subtract_products(column, column);
        UNROLLED for (int c = 0; c < LANES; ++c) {
            inv[c] = inverse_pivot(a[c][c], before[c]);
            a[c] *= inv[c];
            for (int d = c + 1; d < LANES; ++d) a[d] -= a[c] * a[c][d];
        }
        for (int c = 0; c < LANES; ++c)
            for (int d = c + 1; d < LANES; ++d) a[d][c] = a[c][d];
        inverse[column] = inv;
    }

    void divide(int row, int column) {
        subtract_products(row, column);
        const Lanes *l = tile(column, column), inv = inverse[column];
        Lanes* a = tile(row, column);
        UNROLLED for (int c = 0; c < LANES; ++c) {
            Lanes rest = a[c];
            UNROLLED for (int d = 0; d < c; ++d) rest -= a[d] * l[d][c];
            a[c] = rest * inv[c];
        }
    }

    void forward(Vector& y) const {
        for (int column = 0; column < size; ++column) {
            const Lanes* l = tile(column, column);
            const Lanes inv = inverse[column];
            Lanes rest = y[column], found = {};
            UNROLLED for (int c = 0; c < LANES; ++c) {
                const double value = rest[c] * inv[c];
                found[c] = value;
                rest -= l[c] * value;
            }
            y[column] = found;
            for (int row = column + 1; row < std::min(column + depth, size); ++row) {
                const Lanes* l = tile(row, column);
                Lanes a = y[row];
                UNROLLED for (int c = 0; c < LANES; ++c) a -= l[c] * found[c];
                y[row] = a;
            }
        }
    }

    void backward(Vector& y) const {
        for (int column = size - 1; column >= 0; --column) {
            Lanes products[LANES] = {};
            for (int row = column + 1; row < std::min(column + depth, size); ++row) {
                const Lanes *l = tile(row, column), value = y[row];
                UNROLLED for (int c = 0; c < LANES; ++c) products[c] += l[c] * value;
            }
            const Lanes *l = tile(column, column), inv = inverse[column];
            Lanes rest = y[column] - sums(products), found = {};
            UNROLLED for (int c = LANES - 1; c >= 0; --c) {
                const double value = rest[c] * inv[c];
                found[c] = value;
                rest -= l[c] * value;
            }
            y[column] = found;
        }
    }
};

}  // namespace core
