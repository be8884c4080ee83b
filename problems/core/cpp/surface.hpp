// How far points are from a surface of triangles.
#pragma once
#include "box_tree.hpp"

namespace core::covers {

class Surface {
public:
    explicit Surface(const std::vector<Triangle>& triangles) : tree(bounds_of(triangles)), eights(tree.leaves()) {
        for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
            const int begin = tree.first[leaf], last = tree.first[leaf + 1] - 1;
            for (int lane = 0; lane < LANES; ++lane)
                eights[leaf].set(lane, triangles[tree.order[std::min(begin + lane, last)]]);
            eights[leaf].finish();
        }
    }

    // The distance of a point; points near each other follow one another best. Infinity where there is no triangle.
    double distance(const Place& place) {
        double best = std::numeric_limits<double>::infinity();
        if (tree.empty()) return best;
        best = from_leaf(recent, place);
        struct Near {
            double least;
            int child;
        };
        Near waiting[LANES * 17];
        int count = 0;
        waiting[count++] = {0.0, 0};
        while (count) {
            const Near next = waiting[--count];
            if (next.least >= best) continue;
            if (next.child < 0) {
                const double found = from_leaf(~next.child, place);
                if (found < best) best = found, recent = ~next.child;
                continue;
            }
            const EightBoxes& here = tree.nodes[next.child];
            const Eight each = here.nearest(place);
            const int begin = count;
            for (int lane = 0; lane < LANES; ++lane) {
                if (each.lane[lane] >= best) continue;
                int at = count++;  // the nearest last, as it is looked at first
                for (; at > begin && waiting[at - 1].least < each.lane[lane]; --at) waiting[at] = waiting[at - 1];
                waiting[at] = {each.lane[lane], here.child[lane]};
            }
        }
        return std::sqrt(best);
    }

private:
    BoxTree tree;
    std::vector<EightTriangles> eights;
    int recent = 0;

    static std::vector<Bounds> bounds_of(const std::vector<Triangle>& triangles) {
        std::vector<Bounds> found(triangles.size(), Bounds::none());
        for (size_t k = 0; k < triangles.size(); ++k)
            for (const Place& corner : triangles[k].corner) found[k].include(corner);
        return found;
    }

    double from_leaf(int leaf, const Place& place) const {
        const Lanes each = eights[leaf].squared_distances(place);
        double found = each[0];
        for (int lane = 1; lane < LANES; ++lane) found = std::min(found, each[lane]);
        return found;
    }
};

}  // namespace core::covers
