// What Python calls: places, limits, cells and guards in; rates, control points and durations in and out.
#include <new>

#include "through.hpp"

// Whether it is solved. Orders and first control points of rows are (m,); the rest is as in `Stops`, `Cells` and `Guards`.
extern "C" int core_through(int degree, int segments, int joints, const double* places, const double* limits,
                            const double* ends, const double* turns, int count, double price, int m,
                            const int* orders, const int* first,
                            const double* weights, const double* bends, const double* ranges, int guarded,
                            const int* guarded_segments, const int* guarded_points, const double* slopes,
                            const double* by_tau, const double* least, double* rates, double* inner,
                            double* durations) {
    using namespace core;
    try {
        const Stops stops{segments, joints, places, limits, ends, turns};
        Cells cells{count, price, {}, weights, bends, ranges};
        const Guards guards{guarded, guarded_segments, guarded_points, slopes, by_tau, least};
        for (int r = 0; r < m; ++r) cells.rows.push_back({orders[r], first[r]});
        if (degree == 2) return Through<2>(stops, cells, guards)(rates, inner, durations);
        if (degree == 3) return Through<3>(stops, cells, guards)(rates, inner, durations);
        return 0;
    } catch (const std::bad_alloc&) {
        return 0;
    }
}
