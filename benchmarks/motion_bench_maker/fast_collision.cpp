// Are all postures of a list free? Spheres on a chain of turning joints against boxes, cylinders and each other.
// For planners that ask this some hundred thousand times; collision.py is what motions are judged with.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace {
using Point = std::array<double, 3>;
struct Frame {
    std::array<double, 9> r;  // row by row
    Point t;
};

Point apply(const Frame& f, const double* p) {
    Point result;
    for (int i = 0; i < 3; ++i)
        result[i] = f.r[3 * i] * p[0] + f.r[3 * i + 1] * p[1] + f.r[3 * i + 2] * p[2] + f.t[i];
    return result;
}

Frame times(const Frame& a, const Frame& b) {
    Frame result;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            result.r[3 * i + j] = a.r[3 * i] * b.r[j] + a.r[3 * i + 1] * b.r[3 + j] + a.r[3 * i + 2] * b.r[6 + j];
    result.t = apply(a, b.t.data());
    return result;
}

Frame turned(const double* axis, double angle) {
    const double s = std::sin(angle), c = 1.0 - std::cos(angle), x = axis[0], y = axis[1], z = axis[2];
    return {{1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y,
             c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x,
             c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y)}, {0, 0, 0}};
}

double distance(const Point& p, const double* obstacle) {  // rotation 9, position 3, half sizes 3, whether round
    const double d[3] = {p[0] - obstacle[9], p[1] - obstacle[10], p[2] - obstacle[11]};
    double beyond[3];
    for (int j = 0; j < 3; ++j)
        beyond[j] = obstacle[j] * d[0] + obstacle[3 + j] * d[1] + obstacle[6 + j] * d[2];
    if (obstacle[15] != 0.0) {
        const double across = std::hypot(beyond[0], beyond[1]) - obstacle[12], along = std::fabs(beyond[2]) - obstacle[14];
        return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) + std::min(std::max(across, along), 0.0);
    }
    double outside = 0.0;
    for (int j = 0; j < 3; ++j) {
        beyond[j] = std::fabs(beyond[j]) - obstacle[12 + j];
        outside += std::max(beyond[j], 0.0) * std::max(beyond[j], 0.0);
    }
    return std::sqrt(outside) + std::min(std::max({beyond[0], beyond[1], beyond[2]}), 0.0);
}
}  // namespace

extern "C" int all_free(int rows, int joints, const double* theta, const double* placements, const double* axes,
                        int spheres, const int* bodies, const double* centers, const double* radii,
                        int obstacles, const double* obstacle, int pairs, const int* pair, double margin) {
    std::vector<Frame> frames(joints + 1);
    std::vector<Point> points(spheres);
    frames[0] = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    for (int row = 0; row < rows; ++row) {
        for (int j = 0; j < joints; ++j) {
            const double* m = placements + 16 * j;
            const Frame placement = {{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
            frames[j + 1] = times(times(frames[j], placement), turned(axes + 3 * j, theta[row * joints + j]));
        }
        for (int s = 0; s < spheres; ++s) {
            points[s] = apply(frames[bodies[s]], centers + 3 * s);
            for (int o = 0; o < obstacles; ++o)
                if (distance(points[s], obstacle + 16 * o) <= radii[s] + margin) return 0;
        }
        for (int p = 0; p < pairs; ++p) {
            const Point &a = points[pair[2 * p]], &b = points[pair[2 * p + 1]];
            const double apart = radii[pair[2 * p]] + radii[pair[2 * p + 1]] + margin;
            const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
            if (x * x + y * y + z * z <= apart * apart) return 0;
        }
    }
    return 1;
}
