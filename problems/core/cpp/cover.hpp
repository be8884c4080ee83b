// Few balls that hold a body: chosen greedily among balls around points inside, proven to hold every triangle.
//
// A ball around a point inside may reach as far beyond the nearest triangle that is seen from outside as the cover is to
// overhang; around a point of the surface, it has just that radius. What the proof finds in no ball becomes points of the
// next round.
#pragma once
#include <optional>
#include <unordered_set>

#include "choice.hpp"
#include "lattice.hpp"
#include "surface.hpp"

namespace core::covers {

// As `CoverSettings` in Python, which says what they are.
struct Settings {
    double quantum, usual_voxel, voxel_share, most_voxels, aligned_share, thinning, sample_depth, coarseness, most_rounds,
        most_balls, directions;
};

struct Cover {
    std::vector<Ball> balls;
    double usual_overhang, largest_overhang, volume_ratio;
};

// Cells of a lattice, in each of which one point is kept.
class Thinning {
public:
    explicit Thinning(double cell) : cell(cell) {}

    // Whether a point is the first in its cell.
    bool keeps(const Place& point) {
        unsigned long long key = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const long long place = (long long)std::floor(point[axis] / cell);
            key = key * PRIME + (unsigned long long)place;
        }
        return seen.insert(key).second;
    }

private:
    static constexpr unsigned long long PRIME = 2097169;  // more cells than are beside each other along an axis
    const double cell;
    std::unordered_set<unsigned long long> seen;
};

inline std::vector<Place> thinned(const std::vector<Place>& points, double cell) {
    Thinning thinning(cell);
    std::vector<Place> found;
    for (const Place& point : points)
        if (thinning.keeps(point)) found.push_back(point);
    return found;
}

class Body {
public:
    Body(const std::vector<Triangle>& triangles, double overhang, const Settings& settings)
        : triangles(triangles), overhang(overhang), settings(settings),
          lattice(triangles, voxel_of(triangles, overhang, settings)), outer(seen()), surface(outer) {}

    // None where more balls than there may be are needed; no balls where no cover is proven.
    std::optional<Cover> cover() {
        std::vector<Ball> balls = candidates(), held;
        const double margin = settings.sample_depth * overhang;
        std::vector<Place> points = samples();
        add_around(thinned(bare(points, balls, margin), 0.75 * overhang), balls);
        for (int round = 0; round < settings.most_rounds; ++round) {
            for (const int ball : chosen(points, balls, margin, (size_t)settings.most_balls + 1 - held.size()))
                held.push_back(balls[ball]);
            if (held.size() > settings.most_balls) return std::nullopt;
            const std::vector<Place> missed = BallTree(held).not_held(triangles, settings.coarseness * overhang);
            if (missed.empty()) return measured(held);
            points = thinned(missed, settings.coarseness / 2.0 * overhang);
            add_around(points, balls);
        }
        return Cover{};
    }

private:
    const std::vector<Triangle>& triangles;
    const double overhang;
    const Settings& settings;
    const Lattice lattice;
    const std::vector<Triangle> outer;
    Surface surface;

    static double voxel_of(const std::vector<Triangle>& triangles, double overhang, const Settings& settings) {
        Bounds bounds = Bounds::none();
        for (const Triangle& triangle : triangles)
            for (const Place& corner : triangle.corner) bounds.include(corner);
        double voxel = std::min(overhang, std::max(settings.usual_voxel, settings.voxel_share * overhang));
        const auto count = [&] {
            double product = 1.0;
            for (int axis = 0; axis < 3; ++axis) product *= (bounds.high[axis] - bounds.low[axis]) / voxel + 6.0;
            return product;
        };
        while (count() > settings.most_voxels) voxel *= 1.05;
        return voxel;
    }

    // The surface that can be seen from outside, in pieces that are as large as they are seen as a whole.
    std::vector<Triangle> seen() const {
        std::vector<Triangle> found;
        for (const Triangle& triangle : triangles)
            if (is_seen(triangle, found)) found.push_back(triangle);
        return found;
    }

    bool is_seen(const Triangle& triangle, std::vector<Triangle>& parts) const {
        double longest;
        const int apex = triangle.apex(longest);
        if (longest <= lattice.voxel * lattice.voxel) return lattice.exposed(triangle.middle());
        Triangle one, other;
        triangle.halve(apex, one, other);
        const bool first = is_seen(one, parts), second = is_seen(other, parts);
        if (first && second) return true;
        if (first) parts.push_back(one);
        if (second) parts.push_back(other);
        return false;
    }

    Place rounded(const Place& place) const {
        const double quantum = settings.quantum;
        return {std::nearbyint(place.x / quantum) * quantum, std::nearbyint(place.y / quantum) * quantum,
                std::nearbyint(place.z / quantum) * quantum};
    }

    Ball ball(const Place& center, double radius) const {
        return {center, std::floor(radius / settings.quantum) * settings.quantum};
    }

    // Balls around points inside, those of each size spaced.
    std::vector<Ball> candidates() {
        const std::vector<float> depths = lattice.depths();
        std::vector<size_t> ridges = lattice.ridges(depths, settings.aligned_share);
        std::stable_sort(ridges.begin(), ridges.end(), [&](size_t a, size_t b) { return depths[a] > depths[b]; });
        std::vector<Ball> found;
        std::optional<Thinning> thinning;
        int size = -1;
        for (const size_t number : ridges) {
            const int own = std::ilogb(std::max(depths[number], 1.0f));
            if (own != size) {
                size = own;
                const double radius = lattice.voxel * std::ldexp(1.0, size) + overhang;
                thinning.emplace(settings.thinning * std::sqrt(2.0 * radius * overhang));
            }
            if (!thinning->keeps(lattice.middle(number))) continue;
            const Place inside = rounded(lattice.middle(number));
            found.push_back(ball(inside, surface.distance(inside) + overhang));
        }
        return found;
    }

    // Points of the surface that can be seen from outside.
    std::vector<Place> samples() const {
        Thinning thinning(std::max(0.2 * overhang, 0.75 * lattice.voxel));
        std::vector<Place> found;
        for (const Triangle& triangle : outer) sample(triangle, thinning, found);
        return found;
    }

    void sample(const Triangle& triangle, Thinning& thinning, std::vector<Place>& found) const {
        double longest;
        const int apex = triangle.apex(longest);
        if (longest <= lattice.voxel * lattice.voxel) {
            if (thinning.keeps(triangle.middle())) found.push_back(triangle.middle());
            return;
        }
        Triangle one, other;
        triangle.halve(apex, one, other);
        sample(one, thinning, found);
        sample(other, thinning, found);
    }

    // Points that no ball holds, deeper than a margin.
    static std::vector<Place> bare(const std::vector<Place>& points, const std::vector<Ball>& balls, double margin) {
        Remaining remaining(points);
        for (const Ball& own : balls) remaining.take({own.center, own.radius - margin});
        return remaining.left();
    }

    void add_around(const std::vector<Place>& points, std::vector<Ball>& balls) const {
        for (const Place& point : points) balls.push_back(ball(rounded(point), overhang));
    }

    Cover measured(const std::vector<Ball>& balls) {
        std::vector<double> away = overhangs(balls);
        Cover found{balls, 0.0, 0.0, volume_ratio(balls)};
        if (away.empty()) return found;
        const size_t usual = (size_t)std::ceil(0.95 * (double)(away.size() - 1));
        std::nth_element(away.begin(), away.begin() + usual, away.end());
        found.usual_overhang = away[usual];
        found.largest_overhang = *std::max_element(away.begin() + usual, away.end());
        return found;
    }

    // Distances of points of the balls' outside from the body.
    std::vector<double> overhangs(const std::vector<Ball>& balls) const {
        const BallTree tree(balls);
        Surface all_of_it(triangles);
        Thinning thinning(lattice.voxel);
        std::vector<double> found;
        const int count = (int)settings.directions;
        for (const Ball& own : balls)
            for (int k = 0; k < count; ++k) {
                const Place point = own.center + own.radius * direction(k, count);
                if (tree.holds(point, settings.quantum) || !thinning.keeps(point)) continue;
                found.push_back(lattice.is_deep(point) ? 0.0 : all_of_it.distance(point));
            }
        return found;
    }

    // One of many points all over the unit sphere, on a spiral.
    static Place direction(int number, int count) {
        const double golden = 3.23606797749978969641, z = 1.0 - 2.0 * (number + 0.5) / count;
        const double turns = golden / 2.0 * (number + 0.5), across = std::sqrt(1.0 - z * z);
        Lanes sine, cosine;
        sine_cosine(all(6.28318530717958647693 * (turns - std::floor(turns))), sine, cosine);
        return {across * cosine[0], across * sine[0], z};
    }

    double volume_ratio(const std::vector<Ball>& balls) const;
};

// The volume of balls and body over that of the body, by points of a lattice: bits of those in balls, and which of them the
// body encloses.
inline double Body::volume_ratio(const std::vector<Ball>& balls) const {
    const double step = std::max(lattice.voxel, settings.usual_voxel);
    Bounds bounds = Bounds::none();
    for (const Ball& own : balls) bounds.include(own.bounds());
    long shape[3];
    for (int axis = 0; axis < 3; ++axis) shape[axis] = (long)std::ceil((bounds.high[axis] - bounds.low[axis]) / step) + 1;
    const auto place = [&](int axis, long k) { return bounds.low[axis] + k * step; };
    const auto number = [&](int axis, double value) {
        return std::clamp((long)std::ceil((value - bounds.low[axis]) / step), 0L, shape[axis]);
    };
    const long words = (shape[2] + 63) / 64;
    std::vector<unsigned long long> bits((size_t)shape[0] * shape[1] * words);
    for (const Ball& own : balls)
        for (long x = number(0, own.center.x - own.radius); x < number(0, own.center.x + own.radius); ++x)
            for (long y = number(1, own.center.y - own.radius); y < number(1, own.center.y + own.radius); ++y) {
                const double u = place(0, x) - own.center.x, v = place(1, y) - own.center.y;
                const double left = own.radius * own.radius - u * u - v * v;
                if (left <= 0.0) continue;
                const double half = std::sqrt(left);
                const long first = number(2, own.center.z - half), end = number(2, own.center.z + half);
                unsigned long long* row = &bits[((size_t)x * shape[1] + y) * words];
                for (long z = first; z < end;) {
                    const long last = std::min(end, (z / 64 + 1) * 64);
                    const unsigned long long ones = last - z == 64 ? ~0ULL : ((1ULL << (last - z)) - 1);
                    row[z / 64] |= ones << (z % 64);
                    z = last;
                }
            }
    double inside = 0.0, outside = 0.0;
    for (long x = 0; x < shape[0]; ++x)
        for (long y = 0; y < shape[1]; ++y)
            for (long z = 0; z < shape[2]; ++z) {
                const bool own = lattice.encloses({place(0, x), place(1, y), place(2, z)});
                inside += own;
                outside += !own && (bits[((size_t)x * shape[1] + y) * words + z / 64] >> (z % 64) & 1);
            }
    return 1.0 + outside / std::max(inside, 1.0);
}

}  // namespace core::covers
