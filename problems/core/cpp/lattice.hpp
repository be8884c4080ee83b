// Triangles and what they enclose, on a lattice of voxels: what no flood from outside reaches is filled, so that a body
// counts as solid whether its surface is closed or not.
#pragma once
#include <cstring>

#include "box_tree.hpp"

namespace core::covers {

constexpr int ROW = 16;  // voxels that are computed at once
typedef float Floats __attribute__((vector_size(ROW * sizeof(float))));

class Lattice {
public:
    double voxel, origin[3];
    long shape[3];  // along x, y and z; neighbours along z are beside one another in memory

    Lattice(const std::vector<Triangle>& triangles, double voxel) : voxel(voxel) {
        Bounds bounds = Bounds::none();
        for (const Triangle& triangle : triangles)
            for (const Place& corner : triangle.corner) bounds.include(corner);
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] = bounds.low[axis] - BORDER * voxel;
            shape[axis] = (long)std::ceil((bounds.high[axis] - origin[axis]) / voxel) + 3;
        }
        shape[2] = (shape[2] + ROW - 1) / ROW * ROW;
        states.assign((size_t)shape[0] * shape[1] * shape[2], 0);
        for (const Triangle& triangle : triangles) touch(triangle);
        flood();
        expose();
    }

    bool filled(size_t number) const { return !(states[number] & OUTSIDE); }
    bool touched(size_t number) const { return states[number] & TOUCHED; }
    size_t size() const { return states.size(); }

    // Whether a point is in a filled voxel.
    bool encloses(const Place& place) const { return !(state_at(place) & OUTSIDE); }

    // Whether a point is in a filled voxel that no triangle touches.
    bool is_deep(const Place& place) const { return !state_at(place); }

    // Whether what is at a point of the surface can be seen from outside: its voxel is next to one that is.
    bool exposed(const Place& place) const { return states[number_at(place)] & EXPOSED; }

    Place middle(size_t number) const {
        const long z = number % shape[2], y = number / shape[2] % shape[1], x = number / shape[2] / shape[1];
        return {origin[0] + (x + 0.5) * voxel, origin[1] + (y + 0.5) * voxel, origin[2] + (z + 0.5) * voxel};
    }

    // Of every filled voxel the distance to the nearest that is not, in voxels; 0 of others.
    std::vector<float> depths() const {
        std::vector<float> found(size());
        for (size_t row = 0; row < size(); row += shape[2]) along_row(row, &found[row]);
        const long plane = shape[1] * shape[2];
        for (long x = 0; x < shape[0]; ++x) across_rows(&found[x * plane], shape[1], shape[2]);
        for (long y = 0; y < shape[1]; ++y) across_rows(&found[y * shape[2]], shape[0], plane);
        for (float& depth : found) depth = std::sqrt(depth);
        return found;
    }

    // Voxels inside whose depth grows towards no neighbour by most of the way there: a ball around any other would be in
    // one around a neighbour.
    std::vector<size_t> ridges(const std::vector<float>& depths, double aligned_share) const {
        std::vector<std::pair<long, float>> around;
        for (int length : {1, 2, 3})
            for (int x = -1; x <= 1; ++x)
                for (int y = -1; y <= 1; ++y)
                    for (int z = -1; z <= 1; ++z)
                        if (x * x + y * y + z * z == length)
                            around.push_back({(x * shape[1] + y) * shape[2] + z,
                                              (float)(aligned_share * std::sqrt((double)length))});
        std::vector<size_t> found;
        for (size_t number = 0; number < size(); ++number) {
            if (states[number]) continue;
            const float own = depths[number];
            const auto grows = [&](const auto& step) { return depths[number + step.first] >= own + step.second; };
            if (std::none_of(around.begin(), around.end(), grows)) found.push_back(number);
        }
        return found;
    }

private:
    static constexpr double BORDER = 2.5;  // voxels outside, so that all of the border is
    static constexpr unsigned char TOUCHED = 1, OUTSIDE = 2, EXPOSED = 4;
    std::vector<unsigned char> states;

    size_t number_of(const long* at) const { return ((size_t)at[0] * shape[1] + at[1]) * shape[2] + at[2]; }

    unsigned char state_at(const Place& place) const {
        long at[3];
        for (int axis = 0; axis < 3; ++axis) {
            at[axis] = (long)std::floor((place[axis] - origin[axis]) / voxel);
            if (at[axis] < 0 || at[axis] >= shape[axis]) return OUTSIDE;
        }
        return states[number_of(at)];
    }

    size_t number_at(const Place& place) const {
        long at[3];
        for (int axis = 0; axis < 3; ++axis)
            at[axis] = std::clamp((long)std::floor((place[axis] - origin[axis]) / voxel), 0L, shape[axis] - 1);
        return number_of(at);
    }

    // Pieces of the surface no longer than a voxel are where their corners and middles are.
    void touch(const Triangle& triangle) {
        double longest;
        const int apex = triangle.apex(longest);
        if (longest <= voxel * voxel) {
            states[number_at(triangle.middle())] |= TOUCHED;
            for (const Place& corner : triangle.corner) states[number_at(corner)] |= TOUCHED;
            return;
        }
        Triangle one, other;
        triangle.halve(apex, one, other);
        touch(one);
        touch(other);
    }

    // What the outside reaches from a corner of the lattice, through sides of voxels, a run along z at a time.
    void flood() {
        std::vector<size_t> waiting{0};
        const long depth = shape[2], steps[4] = {-shape[1] * depth, shape[1] * depth, -depth, depth};
        while (!waiting.empty()) {
            const size_t start = waiting.back();
            waiting.pop_back();
            if (states[start]) continue;
            const size_t row = start / depth * depth;
            size_t first = start, end = start + 1;
            while (first > row && !states[first - 1]) --first;
            while (end < row + depth && !states[end]) ++end;
            std::memset(&states[first], OUTSIDE, end - first);
            const long y = row / depth % shape[1], x = row / depth / shape[1];
            const bool inside[4] = {x > 0, x + 1 < shape[0], y > 0, y + 1 < shape[1]};
            for (int side = 0; side < 4; ++side)
                for (size_t k = first; inside[side] && k < end; ++k)
                    if (!states[k + steps[side]] && (k == first || states[k + steps[side] - 1]))
                        waiting.push_back(k + steps[side]);
        }
    }

    void expose() {
        const long plane = shape[1] * shape[2];
        for (size_t number = 0; number < size(); ++number) {
            if (!touched(number)) continue;
            bool seen = false;
            for (long x = -1; x <= 1 && !seen; ++x)
                for (long y = -1; y <= 1 && !seen; ++y)
                    for (long z = -1; z <= 1; ++z) seen |= !filled(number + x * plane + y * shape[2] + z);
            if (seen) states[number] |= EXPOSED;
        }
    }

    // Squared distances to what is not filled in the same row, in voxels.
    void along_row(size_t row, float* found) const {
        float away = 0.0f;
        for (long z = 0; z < shape[2]; ++z) found[z] = away = filled(row + z) ? away + 1.0f : 0.0f;
        for (long z = shape[2] - 1; z >= 0; --z) {
            away = filled(row + z) ? away + 1.0f : 0.0f;
            found[z] = std::min(found[z], away) * std::min(found[z], away);
        }
    }

    // The least of squared distances to places in rows and those of the rows from each other, `count` rows that are
    // `step` apart; the first and the last are outside.
    void across_rows(float* rows, long count, long step) const {
        std::vector<float> known((size_t)count * ROW);
        for (long z = 0; z < shape[2]; z += ROW) {
            bool any = false;
            for (long k = 0; k < count; ++k) {
                Floats row;
                std::memcpy(&row, rows + k * step + z, sizeof row);
                std::memcpy(&known[k * ROW], &row, sizeof row);
                for (int lane = 0; lane < ROW; ++lane) any |= row[lane] > 0.0f;
            }
            for (long k = 1; any && k + 1 < count; ++k) lower(known, k, count, rows + k * step + z);
        }
    }

    static void lower(const std::vector<float>& known, long place, long count, float* row) {
        Floats best;
        std::memcpy(&best, row, sizeof best);
        for (long away = 1; away < count; ++away) {
            const float square = (float)(away * away);
            const auto farther = best > square;
            bool any = false;
            for (int lane = 0; lane < ROW; ++lane) any |= farther[lane];
            if (!any) break;
            for (const long other : {place - away, place + away}) {
                if (other < 0 || other >= count) continue;
                Floats found;
                std::memcpy(&found, &known[other * ROW], sizeof found);
                found += square;
                best = found < best ? found : best;
            }
        }
        std::memcpy(row, &best, sizeof best);
    }
};

}  // namespace core::covers
