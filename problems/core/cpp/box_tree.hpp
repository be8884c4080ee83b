// A tree of boxes with sides along the axes: what a box is far from, all in it is far from.
#pragma once
#include <numeric>
#include <vector>

#include "triangles.hpp"

namespace core::covers {

struct Bounds {
    double low[3], high[3];

    static Bounds none() {
        const double far = std::numeric_limits<double>::infinity();
        return {{far, far, far}, {-far, -far, -far}};
    }

    void include(const Bounds& other) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], other.low[axis]);
            high[axis] = std::max(high[axis], other.high[axis]);
        }
    }

    void include(const Place& place) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], place[axis]);
            high[axis] = std::max(high[axis], place[axis]);
        }
    }
};

// Numbers of eight boxes or points; loops over them become vector operations of whatever width there is, which
// comparisons of `Lanes` do with AVX-512 alone.
struct Eight {
    double lane[LANES];

    // One bit for each that is at most a number.
    unsigned at_most(double most) const {
        unsigned found = 0;
        for (int k = 0; k < LANES; ++k) found |= (unsigned)(lane[k] <= most) << k;
        return found;
    }
};

// Boxes side by side, each around a node or a leaf.
struct EightBoxes {
    Eight low[3], high[3];
    int child[LANES];  // number of a node; ~number of a leaf

    EightBoxes() {
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < LANES; ++k) {
                low[axis].lane[k] = std::numeric_limits<double>::infinity();  // without a child: far from everything
                high[axis].lane[k] = -low[axis].lane[k];
            }
    }

    void set(int lane, int number, const Bounds& bounds) {
        child[lane] = number;
        for (int axis = 0; axis < 3; ++axis)
            low[axis].lane[lane] = bounds.low[axis], high[axis].lane[lane] = bounds.high[axis];
    }

    // Squared distances of a point from the nearest points of the boxes, 0 inside.
    Eight nearest(const Place& place) const {
        Eight sum{};
        for (int axis = 0; axis < 3; ++axis) {
            const double own = place[axis];
            for (int k = 0; k < LANES; ++k) {
                const double below = low[axis].lane[k] - own, above = own - high[axis].lane[k];
                const double away = std::max(std::max(below, above), 0.0);
                sum.lane[k] += away * away;
            }
        }
        return sum;
    }

    // Those from the farthest points.
    Eight farthest(const Place& place) const {
        Eight sum{};
        for (int axis = 0; axis < 3; ++axis) {
            const double own = place[axis];
            for (int k = 0; k < LANES; ++k) {
                const double away = std::max(own - low[axis].lane[k], high[axis].lane[k] - own);
                sum.lane[k] += away * away;
            }
        }
        return sum;
    }
};

// Items in leaves of at most eight, in the order in which `order` numbers them: those of leaf k from first[k] to
// first[k + 1]. Node 0 is the root, and there is none without items; children follow their parents.
struct BoxTree {
    std::vector<EightBoxes> nodes;
    std::vector<int> order, first;

    explicit BoxTree(const std::vector<Bounds>& items) : order(items.size()) {
        std::iota(order.begin(), order.end(), 0);
        if (!items.empty()) grow(items, {0, (int)items.size()});
        first.push_back((int)items.size());
    }

    bool empty() const { return nodes.empty(); }
    int leaves() const { return (int)first.size() - 1; }

private:
    struct Range {
        int begin, end;
        int size() const { return end - begin; }
    };

    // A node of the items in a range.
    void grow(const std::vector<Bounds>& items, Range range) {
        const int number = (int)nodes.size();
        nodes.emplace_back();
        std::vector<Range> parts{range};
        while (parts.size() < LANES) {
            const auto largest = std::max_element(parts.begin(), parts.end(),
                                                  [](const Range& a, const Range& b) { return a.size() < b.size(); });
            if (largest->size() <= LANES) break;
            const int cut = divided(items, *largest);
            const Range rest{cut, largest->end};
            largest->end = cut;
            parts.insert(largest + 1, rest);
        }
        for (int lane = 0; lane < (int)parts.size(); ++lane) {
            Bounds bounds = Bounds::none();
            for (int k = parts[lane].begin; k < parts[lane].end; ++k) bounds.include(items[order[k]]);
            const bool leaf = parts[lane].size() <= LANES;
            nodes[number].set(lane, leaf ? ~(int)first.size() : (int)nodes.size(), bounds);
            if (leaf) first.push_back(parts[lane].begin);
            else grow(items, parts[lane]);
        }
    }

    // Where the second half of a range begins once items are in order along the longest side of their middles' box.
    int divided(const std::vector<Bounds>& items, Range range) {
        const auto middle = [&](int item, int axis) { return items[item].low[axis] + items[item].high[axis]; };
        Bounds middles = Bounds::none();
        for (int k = range.begin; k < range.end; ++k) {
            const int item = order[k];
            middles.include(Place{middle(item, 0), middle(item, 1), middle(item, 2)});
        }
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (middles.high[k] - middles.low[k] > middles.high[axis] - middles.low[axis]) axis = k;
        const int cut = range.begin + (range.size() / 2 + LANES - 1) / LANES * LANES;  // leaves are full
        std::nth_element(order.begin() + range.begin, order.begin() + cut, order.begin() + range.end, [&](int a, int b) {
            const double x = middle(a, axis), y = middle(b, axis);
            return x != y ? x < y : a < b;
        });
        return cut;
    }
};

// Nodes that are still to be looked at: seven of each level at most, and a node has at least four times the items of a
// child that is one.
class Waiting {
public:
    bool empty() const { return count == 0; }
    int pop() { return nodes[--count]; }
    void push(int node) { nodes[count++] = node; }

private:
    int nodes[LANES * 17], count = 0;
};

// Calls a function with each leaf whose box is no farther from a point than a distance, until it says that this is
// enough; whether it did.
template <typename Function>
bool each_leaf(const BoxTree& tree, const Place& place, double distance, Function function) {
    if (tree.empty()) return false;
    Waiting waiting;
    waiting.push(0);
    while (!waiting.empty()) {
        const EightBoxes& here = tree.nodes[waiting.pop()];
        const unsigned near = here.nearest(place).at_most(distance * distance);
        for (int lane = 0; lane < LANES; ++lane) {
            if (!(near >> lane & 1)) continue;
            if (here.child[lane] >= 0) waiting.push(here.child[lane]);
            else if (function(~here.child[lane])) return true;
        }
    }
    return false;
}

}  // namespace core::covers
