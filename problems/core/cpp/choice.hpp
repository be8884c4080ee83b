// A greedy choice of balls: each in turn holds most of the points that no other holds yet.
#pragma once
#include <queue>

#include "ball_tree.hpp"

namespace core::covers {

// Points in a tree, of which some are taken away.
class Remaining {
public:
    explicit Remaining(const std::vector<Place>& points)
        : points(points), tree(bounds_of(points)), nodes(tree.nodes.size()), leaves(tree.leaves()) {
        for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
            const int begin = tree.first[leaf], count = tree.first[leaf + 1] - begin;
            for (int lane = 0; lane < count; ++lane) leaves[leaf].add(lane, points[tree.order[begin + lane]]);
        }
        if (!tree.empty()) count_all(0);
    }

    // How many points that are left lie in a ball.
    int held(const Ball& ball) const {
        const double most = within(ball);
        int found = 0;
        Waiting waiting;
        if (most > 0.0 && !tree.empty()) waiting.push(0);
        while (!waiting.empty()) {
            const int node = waiting.pop();
            const EightBoxes& here = tree.nodes[node];
            const unsigned touched = here.nearest(ball.center).at_most(most) & nodes[node].present;
            const unsigned inside = touched ? touched & here.farthest(ball.center).at_most(most) : 0;
            for (unsigned rest = touched; rest; rest &= rest - 1) {
                const int lane = lowest(rest);
                if (inside >> lane & 1) found += nodes[node].count[lane];
                else if (here.child[lane] >= 0) waiting.push(here.child[lane]);
                else found += count_of(leaves[~here.child[lane]].in(ball.center, most));
            }
        }
        return found;
    }

    // Takes away those in a ball.
    void take(const Ball& ball) {
        const double most = within(ball);
        if (most > 0.0 && !tree.empty()) take(0, ball.center, most, false);
    }

    // Those that are left.
    std::vector<Place> left() const {
        std::vector<Place> found;
        for (int leaf = 0; leaf < tree.leaves(); ++leaf)
            for (int k = tree.first[leaf]; k < tree.first[leaf + 1]; ++k)
                if (leaves[leaf].present >> (k - tree.first[leaf]) & 1) found.push_back(points[tree.order[k]]);
        return found;
    }

private:
    struct Leaf {
        Eight x, y, z;
        unsigned present = 0;  // a bit for each point that is left

        void add(int lane, const Place& place) {
            x.lane[lane] = place.x, y.lane[lane] = place.y, z.lane[lane] = place.z;
            present |= 1u << lane;
        }

        unsigned in(const Place& center, double most) const {
            Eight away;
            for (int k = 0; k < LANES; ++k) {
                const double u = x.lane[k] - center.x, v = y.lane[k] - center.y, w = z.lane[k] - center.z;
                away.lane[k] = u * u + v * v + w * w;
            }
            return away.at_most(most) & present;
        }
    };

    struct Counts {
        int count[LANES] = {};  // of points that are left, by children
        unsigned present = 0;   // a bit for each child with any

        void set(int lane, int left) {
            count[lane] = left;
            present = left ? present | 1u << lane : present & ~(1u << lane);
        }
    };

    const std::vector<Place>& points;
    BoxTree tree;
    std::vector<Counts> nodes;
    std::vector<Leaf> leaves;

    static std::vector<Bounds> bounds_of(const std::vector<Place>& points) {
        std::vector<Bounds> found;
        for (const Place& point : points) found.push_back({{point.x, point.y, point.z}, {point.x, point.y, point.z}});
        return found;
    }

    // The square of a ball's radius; 0 where that is negative.
    static double within(const Ball& ball) { return ball.radius > 0.0 ? ball.radius * ball.radius : 0.0; }

    static int lowest(unsigned bits) { return __builtin_ctz(bits); }

    static int count_of(unsigned bits) {
        int count = 0;
        for (; bits; bits &= bits - 1) ++count;
        return count;
    }

    int count_all(int node) {
        int total = 0;
        for (int lane = 0; lane < LANES; ++lane) {
            if (!(tree.nodes[node].low[0].lane[lane] < std::numeric_limits<double>::infinity())) continue;
            const int child = tree.nodes[node].child[lane];
            const int count = child >= 0 ? count_all(child) : count_of(leaves[~child].present);
            nodes[node].set(lane, count);
            total += count;
        }
        return total;
    }

    // How many are taken from a node; all of it where it is inside.
    int take(int node, const Place& center, double most, bool inside) {
        const EightBoxes& here = tree.nodes[node];
        const unsigned touched = nodes[node].present & (inside ? ~0u : here.nearest(center).at_most(most));
        const unsigned whole = inside || !touched ? ~0u : here.farthest(center).at_most(most);
        int total = 0;
        for (unsigned rest = touched; rest; rest &= rest - 1) {
            const int lane = lowest(rest), child = here.child[lane];
            const bool all_of_it = whole >> lane & 1;
            int taken = 0;
            if (child >= 0) {
                taken = take(child, center, most, all_of_it);
            } else {
                const unsigned gone = all_of_it ? leaves[~child].present : leaves[~child].in(center, most);
                taken = count_of(gone);
                leaves[~child].present &= ~gone;
            }
            nodes[node].set(lane, nodes[node].count[lane] - taken);
            total += taken;
        }
        return total;
    }
};

// How many points each ball may hold, for the order in which balls are counted: of many points every eighth is looked at,
// and half a standard deviation is added, as counting a ball too early costs less than taking it too late.
inline std::vector<int> estimates(const std::vector<Place>& points, const std::vector<Ball>& balls) {
    constexpr size_t MANY = 20'000, STRIDE = 8;
    const size_t stride = points.size() > MANY ? STRIDE : 1;
    std::vector<Place> looked_at;
    for (size_t k = 0; k < points.size(); k += stride) looked_at.push_back(points[k]);
    const Remaining sample(looked_at);
    std::vector<int> found;
    for (const Ball& ball : balls) {
        const int count = sample.held(ball);
        found.push_back(stride == 1 ? count : (int)(stride * (count + 0.5 * std::sqrt((double)count))) + 1);
    }
    return found;
}

// Numbers of balls that hold all points that any of them holds, deeper than a margin; of no more than `most` balls.
inline std::vector<int> chosen(const std::vector<Place>& points, const std::vector<Ball>& balls, double margin,
                               size_t most) {
    Remaining remaining(points);
    std::vector<Ball> inner;
    for (const Ball& ball : balls) inner.push_back({ball.center, ball.radius - margin});
    const std::vector<int> expected = estimates(points, inner);
    std::priority_queue<std::pair<int, int>> waiting;  // most points first, then the first ball
    for (int ball = 0; ball < (int)balls.size(); ++ball)
        if (expected[ball]) waiting.push({expected[ball], -ball});
    std::vector<int> found;
    while (!waiting.empty() && found.size() < most) {
        const int ball = -waiting.top().second, count = remaining.held(inner[ball]);
        waiting.pop();
        if (!count) continue;
        if (!waiting.empty() && count < waiting.top().first) {
            waiting.push({count, -ball});
            continue;
        }
        remaining.take(inner[ball]);
        found.push_back(ball);
    }
    return found;
}

}  // namespace core::covers
