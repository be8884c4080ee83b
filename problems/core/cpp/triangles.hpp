// Triangles in space: cut in halves, and how far points are from eight of them at once.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "lanes.hpp"

namespace core::covers {

struct Place {
    double x, y, z;
    double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

inline Place operator+(const Place& a, const Place& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Place operator-(const Place& a, const Place& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Place operator*(double factor, const Place& a) { return {factor * a.x, factor * a.y, factor * a.z}; }
inline double square(const Place& a) { return a.x * a.x + a.y * a.y + a.z * a.z; }

struct Triangle {
    Place corner[3];

    Place middle() const {
        const Place sum = corner[0] + corner[1] + corner[2];
        return {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0};
    }

    // The corner opposite to the longest side, and the square of that side's length.
    int apex(double& longest) const {
        int found = 0;
        longest = -1.0;
        for (int k = 0; k < 3; ++k) {
            const double side = square(corner[(k + 2) % 3] - corner[(k + 1) % 3]);
            if (side > longest) longest = side, found = k;
        }
        return found;
    }

    // Two halves, cut across the side opposite to a corner.
    void halve(int apex, Triangle& one, Triangle& other) const {
        const Place top = corner[apex], a = corner[(apex + 1) % 3], b = corner[(apex + 2) % 3];
        const Place cut = {(a.x + b.x) / 2.0, (a.y + b.y) / 2.0, (a.z + b.z) / 2.0};
        one = {{top, a, cut}};
        other = {{top, cut, b}};
    }
};

// Eight triangles side by side, and squared distances from them.
// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
struct EightTriangles {
    Point corner[3], along, across;
    Lanes aa, ab, bb, over;  // over: one over the determinant; not finite where a triangle has no area

    void set(int lane, const Triangle& triangle) {
        for (int k = 0; k < 3; ++k) {
            corner[k].x[lane] = triangle.corner[k].x;
            corner[k].y[lane] = triangle.corner[k].y;
            corner[k].z[lane] = triangle.corner[k].z;
        }
    }

    void finish() {
        along = corner[1] - corner[0], across = corner[2] - corner[0];
        aa = dot(along, along), ab = dot(along, across), bb = dot(across, across);
        over = 1.0 / (aa * bb - ab * ab);
    }

    static INLINE Lanes from_side(const Point& point, const Point& start, const Point& side) {
        const Point away = point - start;
        const Lanes squared = dot(side, side), along = dot(away, side);
        const Lanes share = most(least(along / chosen(squared > 0.0, squared, all(1.0)), all(1.0)), all(0.0));
        const Point foot = {away.x - share * side.x, away.y - share * side.y, away.z - share * side.z};
        return dot(foot, foot);
    }

    Lanes squared_distances(const Place& place) const {
        const Point point = {all(place.x), all(place.y), all(place.z)}, away = point - corner[0];
        const Lanes pa = dot(away, along), pb = dot(away, across);
        const Lanes u = (bb * pa - ab * pb) * over, v = (aa * pb - ab * pa) * over;
        const Mask above = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0);
        const Point foot = {away.x - u * along.x - v * across.x, away.y - u * along.y - v * across.y,
                            away.z - u * along.z - v * across.z};
        const Lanes plane = chosen(above, dot(foot, foot), all(std::numeric_limits<double>::infinity()));
        const Lanes sides = least(least(from_side(point, corner[0], along), from_side(point, corner[0], across)),
                                  from_side(point, corner[1], corner[2] - corner[1]));
        return least(plane, sides);
    }
};

}  // namespace core::covers
