// What Python calls: triangles in, balls that hold them out.
#include <new>

#include "cover.hpp"

namespace core::covers {
namespace {

std::vector<Triangle> triangles_of(int count, const double* corners) {
    std::vector<Triangle> found(count);
    for (int k = 0; k < count; ++k)
        for (int c = 0; c < 3; ++c, corners += 3) found[k].corner[c] = {corners[0], corners[1], corners[2]};
    return found;
}

std::vector<Ball> balls_of(int count, const double* numbers) {
    std::vector<Ball> found(count);
    for (Ball& ball : found) ball = {{numbers[0], numbers[1], numbers[2]}, numbers[3]}, numbers += 4;
    return found;
}

}  // namespace
}  // namespace core::covers

extern "C" {

// How many balls (most_balls, 4), centres and radii, hold triangles (count, 3, 3); 0 where more were needed, -1 where no
// cover was proven, -2 where memory did not suffice. Figures: overhang of 95 % of the surface, and of all, and the ratio
// of the volumes.
int core_cover(int count, const double* corners, double overhang, const double* settings, double* balls,
               double* figures) {
    using namespace core::covers;
    try {
        Settings own;
        static_assert(sizeof own == 11 * sizeof(double), "an array of numbers is settings");
        std::memcpy(&own, settings, sizeof own);
        const std::vector<Triangle> triangles = triangles_of(count, corners);
        const std::optional<Cover> cover = Body(triangles, overhang, own).cover();
        if (!cover) return 0;
        if (cover->balls.empty()) return -1;
        for (const Ball& ball : cover->balls) {
            *balls++ = ball.center.x, *balls++ = ball.center.y, *balls++ = ball.center.z;
            *balls++ = ball.radius;
        }
        figures[0] = cover->usual_overhang, figures[1] = cover->largest_overhang, figures[2] = cover->volume_ratio;
        return (int)cover->balls.size();
    } catch (const std::bad_alloc&) {
        return -2;
    }
}

// How many points of triangles (count, 3, 3) are in none of some balls (held, 4), or on the border of all; at most
// `capacity` are written, (n, 3). -2 where memory did not suffice.
int core_not_held(int count, const double* corners, int held, const double* balls, double resolution, int capacity,
                  double* points) {
    using namespace core::covers;
    try {
        const std::vector<Ball> own = balls_of(held, balls);
        const std::vector<Place> found = BallTree(own).not_held(triangles_of(count, corners), resolution);
        for (size_t k = 0; k < std::min(found.size(), (size_t)capacity); ++k) {
            *points++ = found[k].x, *points++ = found[k].y, *points++ = found[k].z;
        }
        return (int)found.size();
    } catch (const std::bad_alloc&) {
        return -2;
    }
}

// How deep each of some balls (count, 4) overlaps the one of others (held, 4) that it overlaps most, (count,); negative
// where it is apart from all. -2 where memory did not suffice.
int core_overlaps(int held, const double* balls, int count, const double* others, double* depths) {
    using namespace core::covers;
    try {
        const std::vector<Ball> own = balls_of(held, balls);
        for (const Ball& other : balls_of(count, others)) {
            double room = std::numeric_limits<double>::infinity();
            for (const Ball& ball : own) {
                const double least = room + ball.radius, apart = square(ball.center - other.center);
                if (least > 0.0 && apart < least * least) room = std::sqrt(apart) - ball.radius;
            }
            *depths++ = other.radius - room;
        }
        return 0;
    } catch (const std::bad_alloc&) {
        return -2;
    }
}
}
