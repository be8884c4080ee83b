/* Frozen problems of robot motions, for programs in C99, C++11, and in all that can call C.
 *
 * Values have the bits of the suite where all is compiled as the Makefile does it: with doubles of 64 bits, rounded to
 * the nearest, without contraction of operations (-ffp-contract=off). arm_motions_is_intact tells whether they have.
 * Any number of threads may evaluate at once, each with 2 MB of stack. A program has one such library.
 */
#ifndef ARM_MOTIONS_H
#define ARM_MOTIONS_H

#if defined(__GNUC__)
#define ARM_MOTIONS_API __attribute__((visibility("default")))
#else
#define ARM_MOTIONS_API
#endif

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
    const struct arm_motion_content *content; /* the library's own */
} arm_motion;

/* How many problems there are, and one of them, counted from 0; null where there is no such number. */
ARM_MOTIONS_API int arm_motions_count(void);
ARM_MOTIONS_API const arm_motion *arm_motions_at(int number);

/* The problem of a name, spline-3@1 or in full; null where there is none. */
ARM_MOTIONS_API const arm_motion *arm_motions_find(const char *name);

/* Values of candidates; infinite where one is not in the box, or has a NaN. Each of the last three may be null.
 * Four or eight candidates, by the processor, are computed at once: one by one they take as much longer.
 *
 * points: (count, d), one candidate after the other.
 * merit: (count, k), to be minimised: the objective where all constraints hold, more than any feasible one where not.
 * objectives: (count, k), whether constraints hold or not.
 * violations: (count, c), 0 where a constraint holds, else how much of it is broken in all.
 */
ARM_MOTIONS_API void arm_motions_evaluate(
    const arm_motion *problem, const double *points, long long count,
    double *merit, double *objectives, double *violations
);

/* 1 where this library gives the bits with which the suite was frozen, else 0. */
ARM_MOTIONS_API int arm_motions_is_intact(const arm_motion *problem);

#ifdef __cplusplus
}
#endif

#endif
