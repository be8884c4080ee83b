// What Python calls: a program in arrays in, its solution out.
#include <new>

#include "interior_point.hpp"

namespace core {

template <int REACH>
int solved(const Given& given, const Given& squared, const Box& box, double* x, double* tau) {
    Solver<REACH> solver(given, squared, box);
    const int iterations = solver.solve();
    if (iterations == 0) return 0;
    for (int i = 0; i < box.count; ++i) x[i] = box.inside(i, solver.value(i), INSIDE);
    *tau = box.inside(box.tau, solver.value(box.tau), INSIDE);
    return iterations;
}

}  // namespace core

// The number of iterations, or 0 if no solution was found: hard rows contradict one another or the box, or no row may
// reach so many points. Of joint rows r < m1, entry reach r + a of `weights` belongs to control point first[r] + a; of
// the others entry (reach r + a) k + joint. Entries of points outside 0 to n - 1 are ignored. A price of infinity makes
// a row hard. Without a `cost` of the points only tau, prices and squares count; the last are of m3 rows of all joints,
// each with its weight.
extern "C" int core_program(int reach, int k, int n, int m1, const int* joint, const int* first, const double* weights,
                            const double* by_time, const double* bound, int m2, const int* first2,
                            const double* weights2, const double* by_time2, const double* bound2, const double* price2,
                            int m3, const int* first3, const double* weights3, const double* by_time3,
                            const double* bound3, const double* weight3, const double* lower, const double* upper,
                            const double* cost, double tau_cost, double tau_lower, double tau_upper, double* x,
                            double* tau) {
    using namespace core;
    if (k < 1 || n < 1) return 0;
    try {
        const Given given = {k, n, m1, joint, first, weights, by_time, bound, m2, first2,
                             weights2, by_time2, bound2, price2, lower, upper, cost, tau_cost};
        const Given squared = {k, n, 0, nullptr, nullptr, nullptr, nullptr, nullptr, m3, first3,
                               weights3, by_time3, bound3, weight3, lower, upper, nullptr, 0.0};
        const Box box(given, tau_lower, tau_upper);
        if (box.empty()) return 0;
        switch (reach) {
            case 2: return solved<2>(given, squared, box, x, tau);
            case 4: return solved<4>(given, squared, box, x, tau);
            case 5: return solved<5>(given, squared, box, x, tau);
            default: return 0;
        }
    } catch (const std::bad_alloc&) {
        return 0;
    }
}
