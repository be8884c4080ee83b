// Rows of a linear program, each of which reaches REACH consecutive control points and tau, and passes over all of them.
// They come in eights, one in each lane, and begin where tiles of the matrix do; lanes left over hold the row 0 <= 1,
// which changes nothing.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "unknowns.hpp"

namespace core {

// G and h, eight rows a slot: first rows of all joints, which may be soft, then rows of one joint, upper bounds and
// lower bounds.
template <int REACH>
class Rows {
public:
    int slots, soft;    // slots in all; how many of them, the first, may have soft rows
    int bounds;         // slot where bounds of unknowns begin
    Vector bound;       // h
    Vector price;       // 0 in lanes of hard rows

    Rows(const Given& given, const Box& box) : given(given), box(box), points(std::min(REACH, given.n)) {
        pack_dense();
        soft = (int)bound.size();
        pack_joints();
        bounds = (int)bound.size();
        pack_bounds();
        slots = (int)bound.size();
    }

    int tiles() const { return box.tau / LANES; }
    int depth() const { return (REACH * given.k + 2 * LANES - 2) / LANES; }

    void apply(const Vector& y, Vector& result) const {
        const double tau = y[tiles()][0];
        for (const Group& group : groups) {
            const Lanes *weights = &dense[group.at], *values = &y[group.tile];
            for (int slot = group.slot; slot < group.end; ++slot) {
                Lanes products[LANES];
                for (int row = 0; row < LANES; ++row, weights += group.width)
                    multiply(weights, values, group.width, products[row]);
                result[slot] = sums(products) + time[slot] * tau;
            }
        }
        const Lanes* w = joints.data();
        const double* numbers = (const double*)y.data();
        for (const Block& block : blocks) {
            Lanes value[REACH];
            for (int a = 0; a < REACH; ++a)
                for (int lane = 0; lane < LANES; ++lane) value[a][lane] = numbers[block.column[a][lane]];
            for (int slot = block.slot; slot < block.end; ++slot, w += REACH) {
                Lanes total = w[0] * value[0] + w[1] * value[1];
                UNROLLED for (int a = 2; a + 1 < REACH; a += 2) total += w[a] * value[a] + w[a + 1] * value[a + 1];
                if (REACH % 2) total += w[REACH - 1] * value[REACH - 1];
                result[slot] = total + time[slot] * tau;
            }
        }
        Lanes *above = &result[bounds], *below = &result[bounds + up.size()];
        for (size_t i = 0; i < up.size(); ++i) {
            above[i] = up[i] * y[i];
            below[i] = down[i] * y[i];
        }
    }

    void transpose(const Vector& z, Vector& result) const {
        const Lanes *above = &z[bounds], *below = &z[bounds + up.size()];
        for (size_t i = 0; i < up.size(); ++i) result[i] = up[i] * above[i] + down[i] * below[i];
        Lanes along = {};
        for (int slot = 0; slot < bounds; ++slot) along += time[slot] * z[slot];
        result[tiles()][0] += sum(along);
        for (const Group& group : groups) {
            const Lanes* weights = &dense[group.at];
            for (int slot = group.slot; slot < group.end; ++slot, weights += LANES * group.width) {
                for (int i = 0; i < group.width; ++i) {
                    Lanes& total = result[group.tile + i];
                    UNROLLED for (int row = 0; row < LANES; ++row)
                        total += weights[row * group.width + i] * z[slot][row];
                }
            }
        }
        const Lanes* w = joints.data();
        double* numbers = (double*)result.data();
        for (const Block& block : blocks) {
            Lanes total[REACH] = {};
            for (int slot = block.slot; slot < block.end; ++slot, w += REACH)
                UNROLLED for (int a = 0; a < REACH; ++a) total[a] += w[a] * z[slot];
            for (int a = 0; a < REACH; ++a)
                for (int lane = 0; lane < LANES; ++lane) numbers[block.column[a][lane]] += total[a][lane];
        }
    }

    // Adds G'DG to a matrix.
    void weigh(const Vector& weight, Banded& matrix) const {
        Lanes corner = {};
        for (int slot = 0; slot < bounds; ++slot) corner += weight[slot] * time[slot] * time[slot];
        matrix.corner += sum(corner);
        for (const Group& group : groups) weigh_group(group, weight, matrix);
        const Lanes* w = joints.data();
        for (const Block& block : blocks) {
            weigh_block(block, w, weight, matrix);
            w += REACH * (block.end - block.slot);
        }
        const Lanes *above = &weight[bounds], *below = &weight[bounds + up.size()];
        for (size_t i = 0; i < up.size(); ++i) {
            const Lanes total = up[i] * above[i] - down[i] * below[i];
            if (i == up.size() - 1) matrix.corner += total[0];
            else for (int lane = 0; lane < LANES; ++lane) matrix.add(i * LANES + lane, i * LANES + lane, total[lane]);
        }
    }

private:
    // Rows of all joints that begin in the same tile; they reach `width` tiles.
    struct Group {
        int slot, end, tile, width;
        size_t at;  // of the weights: width for each row
    };
    // Eight pairs of a joint and a first control point, each in its lane, with its rows one after another.
    struct Block {
        int slot, end;
        int column[REACH][LANES];
    };
    const Given& given;
    const Box& box;
    int points;
    std::vector<Group> groups;
    std::vector<Block> blocks;
    Vector dense, joints, time, up, down;

    int window(int first) const { return std::max(0, std::min(first, given.n - points)); }

    // One more slot, of rows 0 <= 1.
    int grow() {
        bound.push_back(all(1.0));
        time.push_back(Lanes{});
        return (int)bound.size() - 1;
    }

    void set(int slot, int lane, double value, double by_time) {
        bound[slot][lane] = value;
        time[slot][lane] = entered(slot, lane, box.tau, by_time);
    }

    // The weight of an unknown in a row; of a constant one zero, as that goes to the right-hand side.
    double entered(int slot, int lane, int column, double weight) {
        if (!box.fixed(column)) return weight;
        bound[slot][lane] -= weight * box.low(column);
        return 0.0;
    }

    void pack_dense() {
        std::vector<int> order;
        for (int r = 0; r < given.m2; ++r)
            if (given.price2[r] > 0.0 && given.bound2[r] != HUGE_VAL) order.push_back(r);
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return window(given.first2[a]) < window(given.first2[b]); });
        int lane = 0;
        for (int r : order) {
            const int from = window(given.first2[r]) * given.k, tile = from / LANES;
            const int width = eights(from % LANES + points * given.k);
            if (groups.empty() || groups.back().tile != tile || groups.back().width != width) {
                groups.push_back({(int)bound.size(), (int)bound.size(), tile, width, dense.size()});
                lane = 0;
            }
            if (lane == 0) {
                groups.back().end = grow() + 1;
                price.push_back(Lanes{});
                dense.resize(dense.size() + LANES * width);
            }
            enter_dense(r, groups.back(), lane);
            lane = (lane + 1) % LANES;
        }
    }

    // In the last slot of the group.
    void enter_dense(int r, const Group& group, int lane) {
        const int slot = group.end - 1;
        Lanes* weights = &dense[group.at + ((slot - group.slot) * LANES + lane) * group.width];
        set(slot, lane, given.bound2[r], given.by_time2[r]);
        if (given.price2[r] != HUGE_VAL) price[slot][lane] = given.price2[r];
        for (int a = 0; a < REACH; ++a) {
            const int point = given.first2[r] + a;
            if (point < 0 || point >= given.n) continue;
            for (int j = 0; j < given.k; ++j) {
                const int column = point * given.k + j, i = column - group.tile * LANES;
                const double weight = given.weights2[(REACH * r + a) * given.k + j];
                weights[i / LANES][i % LANES] = entered(slot, lane, column, weight);
            }
        }
    }

    // Pairs with about as many rows share a block, so that few lanes are left over.
    void pack_joints() {
        std::vector<std::vector<int>> pairs(given.n * given.k);
        for (int r = 0; r < given.m1; ++r)
            if (given.bound[r] != HUGE_VAL) pairs[window(given.first[r]) * given.k + given.joint[r]].push_back(r);
        std::stable_sort(pairs.begin(), pairs.end(),
                         [](const std::vector<int>& a, const std::vector<int>& b) { return a.size() > b.size(); });
        while (!pairs.empty() && pairs.back().empty()) pairs.pop_back();
        for (size_t begin = 0; begin < pairs.size(); begin += LANES) {
            const int slot = (int)bound.size(), count = (int)pairs[begin].size();
            blocks.push_back({slot, slot + count, {}});
            for (int i = 0; i < count; ++i) grow();
            joints.resize(joints.size() + REACH * count);
            for (int lane = 0; lane < std::min(LANES, (int)(pairs.size() - begin)); ++lane)
                enter_joint(pairs[begin + lane], blocks.back(), lane);
        }
    }

    // All rows of a pair, in the last block.
    void enter_joint(const std::vector<int>& rows, Block& block, int lane) {
        const int from = window(given.first[rows[0]]), joint = given.joint[rows[0]];
        for (int a = 0; a < REACH; ++a) block.column[a][lane] = std::min(from + a, given.n - 1) * given.k + joint;
        Lanes* weights = &joints[joints.size() - REACH * (block.end - block.slot)];
        int slot = block.slot;
        for (int r : rows) {
            set(slot, lane, given.bound[r], given.by_time[r]);
            for (int a = 0; a < REACH; ++a) {
                const int point = given.first[r] + a;
                if (point < 0 || point >= given.n) continue;
                const int column = point * given.k + joint;
                weights[point - from][lane] = entered(slot, lane, column, given.weights[REACH * r + a]);
            }
            ++slot;
            weights += REACH;
        }
    }

    void pack_bounds() {
        up.resize(tiles() + 1);
        down = up;
        const int above = (int)bound.size(), below = above + tiles() + 1;
        for (int i = 0; i < 2 * (tiles() + 1); ++i) grow();
        for (int i = 0; i <= box.tau; ++i) {
            const int slot = i / LANES, lane = i % LANES;
            if (box.fixed(i)) continue;
            if (std::isfinite(box.high(i))) {
                up[slot][lane] = 1.0;
                bound[above + slot][lane] = box.high(i);
            }
            if (std::isfinite(box.low(i))) {
                down[slot][lane] = -1.0;
                bound[below + slot][lane] = -box.low(i);
            }
        }
    }

    // All tiles that the rows of a group reach, one after another.
    void weigh_group(const Group& group, const Vector& weight, Banded& matrix) const {
        const int rows = (group.end - group.slot) * LANES, width = group.width;
        const Lanes* weights = &dense[group.at];
        const double *factor = (const double*)&weight[group.slot], *by_time = (const double*)&time[group.slot];
        for (int i = 0; i < width; ++i) {
            Lanes border = matrix.border[group.tile + i];
            for (int r = 0; r < rows; ++r) border += weights[r * width + i] * (factor[r] * by_time[r]);
            matrix.border[group.tile + i] = border;
            for (int j = 0; j <= i; ++j)
                add_products(matrix.tile(group.tile + i, group.tile + j), weights + i, weights + j, width, factor,
                             rows);
        }
    }

    void weigh_block(const Block& block, const Lanes* w, const Vector& weight, Banded& matrix) const {
        Lanes product[REACH][REACH] = {}, border[REACH] = {};
        for (int slot = block.slot; slot < block.end; ++slot, w += REACH) {
            UNROLLED for (int a = 0; a < REACH; ++a) {
                const Lanes weighted = w[a] * weight[slot];
                border[a] += weighted * time[slot];
                UNROLLED for (int b = 0; b <= a; ++b) product[a][b] += weighted * w[b];
            }
        }
        double* along = (double*)matrix.border.data();
        for (int lane = 0; lane < LANES; ++lane) {
            for (int a = 0; a < REACH; ++a) {
                along[block.column[a][lane]] += border[a][lane];
                for (int b = 0; b <= a; ++b)
                    matrix.add(block.column[a][lane], block.column[b][lane], product[a][b][lane]);
            }
        }
    }
};

}  // namespace core
