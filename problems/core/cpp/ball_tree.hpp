// Balls, which of them hold a point, and a proof that they hold triangles: each is cut until every piece lies in one ball.
//
// A triangle lies in a ball when its corners do. Corners must lie deeper in a ball than DEPTH_MARGIN, which is more than
// rounding takes from them. Coordinates are at most X in size, and u = 2^-53. A cut across a side is off by u X along
// each axis, so that both halves leave no more than sqrt(3) u X of a triangle bare, and a piece is cut at most 100 times:
// its sides are halved by every second cut, from 20 m to LEAST_PIECE. A distance of r is off by 4 u r. With X = 1,000 m
// that is 1.9e-11 m in all.
#pragma once
#include "box_tree.hpp"

namespace core::covers {

constexpr double DEPTH_MARGIN = 1e-9;  // m
constexpr double LEAST_PIECE = 1e-5;   // m: a piece so small that lies in no ball is not held

struct Ball {
    Place center;
    double radius;

    Bounds bounds() const {
        Bounds found = Bounds::none();
        for (const double side : {-radius, radius}) found.include(center + Place{side, side, side});
        return found;
    }

    // Whether a point lies in the ball, deeper than a margin.
    bool holds(const Place& place, double margin) const {
        const double least = std::max(radius - margin, 0.0);
        return square(place - center) <= least * least;
    }
};

class BallTree {
public:
    explicit BallTree(const std::vector<Ball>& balls) : balls(balls), tree(bounds_of(balls)) {}

    // Whether a point lies in any ball, deeper than a margin.
    bool holds(const Place& place, double margin) const {
        return each_leaf(tree, place, 0.0, [&](int leaf) {
            for (int k = tree.first[leaf]; k < tree.first[leaf + 1]; ++k)
                if (balls[tree.order[k]].holds(place, margin)) return true;
            return false;
        });
    }

    // Points of triangles that are in no ball, or on the border of all; none where the balls hold all. A piece no longer
    // than `resolution` of which a corner lies in no ball is cut no more.
    std::vector<Place> not_held(const std::vector<Triangle>& triangles, double resolution) const {
        std::vector<Place> found;
        std::vector<int> near;
        for (const Triangle& triangle : triangles) {
            near.clear();
            const Place middle = triangle.middle();
            each_leaf(tree, middle, reach(triangle, middle), [&](int leaf) {
                near.insert(near.end(), tree.order.begin() + tree.first[leaf], tree.order.begin() + tree.first[leaf + 1]);
                return false;
            });
            prove(triangle, near, 0, resolution, found);
        }
        return found;
    }

private:
    const std::vector<Ball>& balls;
    BoxTree tree;

    static std::vector<Bounds> bounds_of(const std::vector<Ball>& balls) {
        std::vector<Bounds> found;
        for (const Ball& ball : balls) found.push_back(ball.bounds());
        return found;
    }

    static double reach(const Triangle& triangle, const Place& middle) {
        double most = 0.0;
        for (const Place& corner : triangle.corner) most = std::max(most, square(corner - middle));
        return std::sqrt(most);
    }

    // Adds the points of a piece that no ball holds, of those from `begin` on that are near to what it was cut from.
    void prove(const Triangle& piece, std::vector<int>& near, size_t begin, double resolution,
               std::vector<Place>& found) const {
        const size_t end = near.size();
        bool held[3] = {};
        for (size_t k = begin; k < end; ++k) {
            int in = 0;
            for (int corner = 0; corner < 3; ++corner) {
                const bool one = balls[near[k]].holds(piece.corner[corner], DEPTH_MARGIN);
                held[corner] |= one, in += one;
            }
            if (in == 3) return;
        }
        double longest;
        const int apex = piece.apex(longest);
        if (longest <= LEAST_PIECE * LEAST_PIECE) {
            found.push_back(piece.middle());
            return;
        }
        if (longest <= resolution * resolution)
            for (int corner = 0; corner < 3; ++corner)
                if (!held[corner]) {
                    found.push_back(piece.corner[corner]);
                    return;
                }
        Triangle halves[2];
        piece.halve(apex, halves[0], halves[1]);
        for (const Triangle& half : halves) {
            const Place middle = half.middle();
            const double most = reach(half, middle);
            for (size_t k = begin; k < end; ++k) {
                const double least = balls[near[k]].radius + most;
                if (square(balls[near[k]].center - middle) <= least * least) near.push_back(near[k]);
            }
            prove(half, near, end, resolution, found);
            near.resize(end);
        }
    }
};

}  // namespace core::covers
