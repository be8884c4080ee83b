/* Frozen problems of robot motions, for programs in C and in all that can call C.
 *
 * Values have the bits of the suite where all is compiled as the Makefile does it: with doubles of 64 bits, and without
 * contraction of operations (-ffp-contract=off). arm_motions_is_intact tells whether they have. Nothing here has a
 * state: any number of threads may evaluate at once, each with 2 MB of stack.
 */
#ifndef ARM_MOTIONS_H
#define ARM_MOTIONS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct arm_motion {
    const char *name;      /* such as arm-motions-1/spline-3@1 */
    int variables;         /* d */
    int objectives;        /* k, 1 or 2 */
    int constraints;       /* c */
    const double *lower;   /* corners of the search box, (d,) each */
    const double *upper;
    double feasible_merit; /* up to which all constraints hold; of two objectives the first merit's */
    double best_known;     /* the lowest merit that is known of a candidate; NaN where none is, and of two objectives */
    double lower_bound;    /* what the objective of no motion that keeps its limits is below; NaN where none is known */
} arm_motion;

/* How many problems there are, and one of them, counted from 0; null where there is no such number. */
int arm_motions_count(void);
const arm_motion *arm_motions_at(int number);

/* The problem of a name; null where there is none. */
const arm_motion *arm_motions_find(const char *name);

/* Values of candidates; infinite where one is not in the box, or has a NaN. Each of the last three may be null.
 * Four or eight candidates, by the processor, are computed at once: one by one they take as much longer.
 *
 * points: (count, d), one candidate after the other.
 * merit: (count, k), to be minimised: the objective where all constraints hold, more than any feasible one where not.
 * objectives: (count, k), whether constraints hold or not.
 * violations: (count, c), 0 where a constraint holds, else how much of it is broken in all.
 */
void arm_motions_evaluate(
    const arm_motion *problem, const double *points, long long count,
    double *merit, double *objectives, double *violations
);

/* 1 where this library gives the bits with which the suite was frozen, else 0. */
int arm_motions_is_intact(const arm_motion *problem);

#ifdef __cplusplus
}
#endif

#endif
