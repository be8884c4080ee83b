// What is behind a problem: the kernels of its function, and the numbers of its instance.
#include "arm_motions.h"

extern "C" typedef void kernel(
    const double *points, double *values, long long count, const double *numbers, const long long *indices
);

struct arm_motion_content {
    kernel *kernels[2]; // one for each objective
    const double *numbers[2];
    const long long *indices[2];
    unsigned long long hash; // of the values at the check points, FNV-1a
};

extern const arm_motion arm_motions_problems[];
extern const int arm_motions_problem_count;
