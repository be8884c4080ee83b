// Descriptions as Python gives them: counts and numbers, one after the other.
#pragma once
#include <algorithm>
#include <vector>

#include "world.hpp"

namespace core {

struct Reader {
    const long long* counts;
    const double* numbers;
    int count() { return (int)*counts++; }
    void fill(double* to, int size) {
        std::copy(numbers, numbers + size, to);
        numbers += size;
    }
    std::vector<double> list(int size) {
        std::vector<double> found(numbers, numbers + size);
        numbers += size;
        return found;
    }
};

inline void multiply(const double* a, const double* b, double* product) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            product[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

// A rotation by an angle about a unit axis k is 1 + sin [k] + (1 - cos) [k]^2.
inline Joint joint_of(Reader& reader) {
    Joint joint{};
    double rotation[9], square[9];
    joint.turns = reader.count() != 0, joint.parent = reader.count();
    reader.fill(rotation, 9);
    reader.fill(joint.translation, 3);
    reader.fill(joint.axis, 3);
    const double *k = joint.axis, crossed[9] = {0.0, -k[2], k[1], k[2], 0.0, -k[0], -k[1], k[0], 0.0};
    multiply(crossed, crossed, square);
    multiply(rotation, crossed, joint.by_sine);
    multiply(rotation, square, joint.by_cosine);
    for (int i = 0; i < 9; ++i) {
        joint.at[i] = rotation[i] + (joint.turns ? joint.by_cosine[i] : 0.0);
        joint.by_cosine[i] = -joint.by_cosine[i];
    }
    for (int i = 0; i < 3; ++i)
        joint.way[i] = rotation[3 * i] * k[0] + rotation[3 * i + 1] * k[1] + rotation[3 * i + 2] * k[2];
    return joint;
}

// Rows (rows, k) of numbers from one on, the last again where there are no more; how many there are.
inline int gathered(const double* values, int rows, int row, int k, std::vector<Lanes>& lanes) {
    lanes.resize(k);
    for (int lane = 0; lane < LANES; ++lane)
        for (int j = 0; j < k; ++j) lanes[j][lane] = values[(size_t)std::min(row + lane, rows - 1) * k + j];
    return std::min(LANES, rows - row);
}

}  // namespace core
