#include <math.h>
#include <stdint.h>
#include <string.h>

#include <vector>

#include "problem.hpp"

static const long long BLOCK = 64; // candidates that a kernel is given at a time
static const int CHECK_POINTS = 64;
static const uint64_t FNV_OFFSET = 0xcbf29ce484222325u, FNV_PRIME = 0x100000001b3u;

// Numbers that a kernel gives for a candidate: merit, objective, violations.
static int width(const arm_motion *problem) {
    return 2 + problem->constraints;
}

static bool is_inside(const arm_motion *problem, const double *point) {
    for (int i = 0; i < problem->variables; i++) {
        if (!(point[i] >= problem->lower[i] && point[i] <= problem->upper[i])) return false;
    }
    return true;
}

static bool is_prime(int number) {
    for (int divisor = 2; divisor * divisor <= number; divisor++) {
        if (number % divisor == 0) return false;
    }
    return true;
}

// Multiples of square roots of primes, without whole parts, stretched over the box: (CHECK_POINTS, d).
static std::vector<double> check_points(const arm_motion *problem) {
    const int d = problem->variables;
    std::vector<double> points(CHECK_POINTS * d);
    int prime = 2;
    for (int i = 0; i < d; i++, prime++) {
        while (!is_prime(prime)) prime++;
        for (int k = 0; k < CHECK_POINTS; k++) {
            double whole;
            const double share = modf((k + 1) * sqrt((double)prime), &whole);
            points[k * d + i] = problem->lower[i] + share * (problem->upper[i] - problem->lower[i]);
        }
    }
    return points;
}

extern "C" int arm_motions_count(void) {
    return arm_motions_problem_count;
}

extern "C" const arm_motion *arm_motions_at(int number) {
    return number >= 0 && number < arm_motions_problem_count ? &arm_motions_problems[number] : nullptr;
}

extern "C" const arm_motion *arm_motions_find(const char *name) {
    for (int number = 0; name && number < arm_motions_problem_count; number++) {
        const char *const whole = arm_motions_problems[number].name, *const slash = strchr(whole, '/');
        if (strcmp(whole, name) == 0 || strcmp(slash + 1, name) == 0) return &arm_motions_problems[number];
    }
    return nullptr;
}

extern "C" void arm_motions_evaluate(
    const arm_motion *problem, const double *points, long long count,
    double *merit, double *objectives, double *violations
) {
    const arm_motion_content &content = *problem->content;
    const int d = problem->variables, k = problem->objectives, c = problem->constraints, columns = width(problem);
    std::vector<double> values(BLOCK * columns);
    for (long long start = 0; start < count; start += BLOCK) {
        const long long rest = count - start < BLOCK ? count - start : BLOCK;
        for (int number = 0; number < k; number++) {
            content.kernels[number](
                points + start * d, values.data(), rest, content.numbers[number], content.indices[number]
            );
            for (long long i = start; i < start + rest; i++) {
                const double *const row = values.data() + (i - start) * columns;
                const bool inside = is_inside(problem, points + i * d);
                if (merit) merit[i * k + number] = inside ? row[0] : INFINITY;
                if (objectives) objectives[i * k + number] = inside ? row[1] : INFINITY;
                if (!violations || number > 0) continue;
                for (int j = 0; j < c; j++) violations[i * c + j] = inside ? row[2 + j] : INFINITY;
            }
        }
    }
}

extern "C" int arm_motions_is_intact(const arm_motion *problem) {
    const arm_motion_content &content = *problem->content;
    const std::vector<double> points = check_points(problem);
    std::vector<double> values(CHECK_POINTS * width(problem));
    uint64_t hash = FNV_OFFSET;
    for (int number = 0; number < problem->objectives; number++) {
        content.kernels[number](
            points.data(), values.data(), CHECK_POINTS, content.numbers[number], content.indices[number]
        );
        for (double value : values) {
            uint64_t bits;
            memcpy(&bits, &value, sizeof bits);
            hash = (hash ^ bits) * FNV_PRIME;
        }
    }
    return hash == content.hash;
}
