// What is behind a problem: the kernels of its function, and the numbers of its instance.
#include "arm_motions.h"

extern "C" typedef void kernel(
    const double *points, double *values, long long count, const double *numbers, const long long *indices
);

struct Problem {
    arm_motion shown; // the first: its address is the problem's
    kernel *kernels[2]; // one for each objective
    const double *numbers[2];
    const long long *indices[2];
    unsigned long long bits; // FNV-1a of the values at the check points
};

extern const Problem arm_motions_problems[];
extern const int arm_motions_problem_count;
