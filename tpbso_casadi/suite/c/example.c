/* Random search with 100 evaluations for each variable, on every problem that this library has. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "arm_motions.h"

enum { BATCH = 100 }; /* candidates at a time, which is faster than one by one */

int main(void) {
    srand(1);
    for (int number = 0; number < arm_motions_count(); number++) {
        const arm_motion *problem = arm_motions_at(number);
        const int d = problem->variables, k = problem->objectives;
        double *x = malloc(BATCH * d * sizeof *x), *merit = malloc(BATCH * k * sizeof *merit), best = INFINITY;
        for (int batch = 0; batch < d; batch++) {
            for (int i = 0; i < BATCH * d; i++) {
                const double low = problem->lower[i % d], high = problem->upper[i % d];
                x[i] = low + (high - low) * (rand() / (double)RAND_MAX);
            }
            arm_motions_evaluate(problem, x, BATCH, merit, NULL, NULL);
            for (int i = 0; i < BATCH; i++) best = fmin(best, merit[i * k]);
        }
        printf(
            "%s: %s, merit %.6g%s, best known %.6g\n", problem->name,
            arm_motions_is_intact(problem) ? "the suite's bits" : "NOT THE SUITE'S VALUES",
            best, best <= problem->feasible_merit ? "" : " (infeasible)", problem->best_known
        );
        free(x);
        free(merit);
    }
    return 0;
}
