// Distances of points from solids, with a sign, one point in each lane. Formulas as in problems/scene/solids.py.
#pragma once
#include <vector>

#include "lanes.hpp"

namespace core {

enum Shape { BALL, BOX, CAPSULE, CYLINDER, ELLIPSOID, HALF_SPACE, POLYTOPE, ASKED };

struct Solid {
    Shape shape;
    double axes[9];    // its own axes in columns
    double center[3];  // m
    double sizes[3];   // radius; half sides; radius and half length; semi-axes, m
    std::vector<double> planes;  // of a hull around a polytope: normal and offset, four numbers each
    std::vector<double> faces;   // of the polytope itself, likewise
    std::vector<double> edges;   // of these: where one begins and the way along it, six numbers each
};

INLINE Point seen_from(const Solid& solid, const Point& p) {
    const Lanes x = p.x - solid.center[0], y = p.y - solid.center[1], z = p.z - solid.center[2];
    const double* a = solid.axes;
    return {a[0] * x + a[3] * y + a[6] * z, a[1] * x + a[4] * y + a[7] * z, a[2] * x + a[5] * y + a[8] * z};
}

INLINE Lanes from_box(const Solid& solid, const Point& p) {
    const Lanes x = size(p.x) - solid.sizes[0], y = size(p.y) - solid.sizes[1], z = size(p.z) - solid.sizes[2];
    const Lanes none = {}, deepest = most(most(x, y), z);
    const Lanes outside = length({most(x, none), most(y, none), most(z, none)});
    return chosen(deepest > 0.0, outside, deepest);
}

INLINE Lanes from_cylinder(const Solid& solid, const Point& p) {
    const Lanes around = root(p.x * p.x + p.y * p.y) - solid.sizes[0], along = size(p.z) - solid.sizes[1];
    const Lanes none = {}, deepest = most(around, along), u = most(around, none), v = most(along, none);
    return chosen(deepest > 0.0, root(u * u + v * v), deepest);
}

INLINE Lanes from_capsule(const Solid& solid, const Point& p) {
    return length({p.x, p.y, most(size(p.z) - solid.sizes[1], Lanes{})}) - solid.sizes[0];
}

// No more than the distance: the part of the point beyond the tangent plane whose normal Newton's method found.
inline Lanes from_ellipsoid(const Solid& solid, const Point& point) {
    const double tiny = 1e-30, *a = solid.sizes;
    const Lanes p[3] = {point.x, point.y, point.z};
    Lanes t = {};
    for (int i = 0; i < 3; ++i) t = most(t, a[i] * size(p[i]) - a[i] * a[i]);
    for (int step = 0; step < 4; ++step) {
        Lanes square = all(tiny), slope = all(tiny);
        for (int i = 0; i < 3; ++i) {
            const Lanes w = a[i] * p[i] / (t + a[i] * a[i]);
            square += w * w;
            slope += w * w / (t + a[i] * a[i]);
        }
        t = most(Lanes{}, t + (root(square) - 1.0) * square / slope);
    }
    const double shortest = std::fmin(a[0], std::fmin(a[1], a[2]));
    Lanes beyond = {}, extent = all(tiny), norm = all(tiny / (shortest * shortest));
    for (int i = 0; i < 3; ++i) {
        const Lanes n = p[i] / (t + a[i] * a[i]);
        beyond += n * p[i];
        extent += a[i] * a[i] * n * n;
        norm += n * n;
    }
    return (beyond - root(extent)) / root(norm);
}

// The square of the distance from an edge: where it begins, and the way along it.
INLINE Lanes from_edge(const double* edge, const Point& p) {
    const double *way = edge + 3, length = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
    const Point away = {p.x - edge[0], p.y - edge[1], p.z - edge[2]};
    const Lanes along = (away.x * way[0] + away.y * way[1] + away.z * way[2]) / length;
    const Lanes share = least(most(along, Lanes{}), all(1.0));
    const Point rest = {away.x - share * way[0], away.y - share * way[1], away.z - share * way[2]};
    return dot(rest, rest);
}

INLINE Lanes beyond(const double* plane, const Point& p) {
    return plane[0] * p.x + plane[1] * p.y + plane[2] * p.z - plane[3];
}

inline Lanes from_planes(const std::vector<double>& planes, const Point& p) {
    Lanes found = all(-HUGE_VAL);
    for (size_t k = 0; k < planes.size(); k += 4) found = most(found, beyond(&planes[k], p));
    return found;
}

// Exact to ON_FACE, and never larger: where the foot on the face that is seen is beside it, the nearest is on an edge.
inline Lanes from_faces(const Solid& solid, const Point& p) {
    const double ON_FACE = 1e-9;  // m
    Lanes far = all(-HUGE_VAL);
    Point normal = {};
    for (size_t k = 0; k < solid.faces.size(); k += 4) {
        const double* face = &solid.faces[k];
        const Lanes found = beyond(face, p);
        const Mask farther = found > far;
        far = chosen(farther, found, far);
        normal.x = chosen(farther, all(face[0]), normal.x);
        normal.y = chosen(farther, all(face[1]), normal.y);
        normal.z = chosen(farther, all(face[2]), normal.z);
    }
    const Point foot = {p.x - far * normal.x, p.y - far * normal.y, p.z - far * normal.z};
    const Mask beside = (far > 0.0) & (from_planes(solid.faces, foot) > ON_FACE);
    if (!bits(beside)) return far;
    Lanes square = all(HUGE_VAL);
    for (size_t k = 0; k < solid.edges.size(); k += 6) square = least(square, from_edge(&solid.edges[k], p));
    return chosen(beside, most(root(square) - ON_FACE, far), far);
}

// The distance, m, or no more than that where it is more than enough.
inline Lanes distance(const Solid& solid, const Point& outside, Lanes enough) {
    const Point p = seen_from(solid, outside);
    switch (solid.shape) {
        case BALL: return length(p) - solid.sizes[0];
        case BOX: return from_box(solid, p);
        case CAPSULE: return from_capsule(solid, p);
        case CYLINDER: return from_cylinder(solid, p);
        case ELLIPSOID: return from_ellipsoid(solid, p);
        case HALF_SPACE: return p.z;
        case POLYTOPE: break;
        case ASKED: return all(-HUGE_VAL);  // those who know are asked instead
    }
    const Lanes low = from_planes(solid.planes, p);
    return bits(low < enough) ? from_faces(solid, p) : low;
}

}  // namespace core
