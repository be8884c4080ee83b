// What Python calls: places, limits and cells in; rates, control points and durations in and out.
#include <new>

#include "through.hpp"

// Whether it is solved. Orders and first control points of rows are (m,); the rest is as in `Stops` and `Cells`.
extern "C" int core_through(int degree, int segments, int joints, const double* places, const double* middles,
                            const double* limits, const double* ends, int count, double price, double range_share, int m,
                            const int* orders, const int* first, const double* weights, const double* bends, double* rates, double* inner,
                            double* durations) {
    using namespace core;
    try {
        const Stops stops{segments, joints, places, middles, limits, ends};
        Cells cells{count, price, range_share, {}, weights, bends};
        for (int r = 0; r < m; ++r) cells.rows.push_back({orders[r], first[r]});
        if (degree == 2) return Through<2>(stops, cells)(rates, inner, durations);
        if (degree == 3) return Through<3>(stops, cells)(rates, inner, durations);
        return 0;
    } catch (const std::bad_alloc&) {
        return 0;
    }
}
