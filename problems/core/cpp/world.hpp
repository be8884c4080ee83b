// A robot and what it keeps clear of, as data; where its balls are in eight postures at once.
#pragma once
#include <algorithm>
#include <vector>

#include "lanes.hpp"
#include "solids.hpp"

namespace core {

// From a joint's own frame to that of the body that it is on: at + sine * by_sine + cosine * by_cosine, of angles; what
// slides is moved along way instead. Bodies are numbered: 0 is the base, the others are moved by the joints in turn, and
// none comes before the one that it is on.
struct Joint {
    bool turns;
    int parent;  // body that it is on
    double at[9], by_sine[9], by_cosine[9], translation[3], way[3], axis[3];
};

// A ball around those of its children, which lie side by side; without children it is a ball of the cover itself.
struct Node {
    double center[3], radius;  // in the frame of its body, m
    int body, first, count;
};

// Two nodes that must keep apart: with all they hold, or pairs of their balls.
struct Group {
    int one, two, begin, end;  // of the pairs; none where all that they hold is meant
    int common;                // the last body on whose branch both are
};

struct Pair {
    int one, two;
};

// How a solid moves: without turning, at a constant velocity, from where its description puts it.
struct Drift {
    double origin[3], velocity[3];  // at t = 0, m; m/s
    double rate;                    // how much more is kept from it with every second, m/s
};

// Who knows solids that the core does not: the distances of eight points (x, y, z, t: 8 each) from one, what more is kept
// then taken off; and how much these may differ in eight cells of time (starts, ends: 8 each) from those in the middle.
struct Asked {
    void (*distances)(int solid, const double* points, double* found);
    void (*travel)(int solid, const double* cells, double* found);
};

struct World {
    int dof;
    double base_rotation[9], base_translation[3];
    std::vector<Joint> joints;
    std::vector<Node> nodes;
    std::vector<Pair> watched;  // root of a link's nodes, solid
    std::vector<Group> groups;
    std::vector<Pair> pairs;
    std::vector<Solid> solids;
    double margins[2];  // kept from solids, and from each other, m
    Asked asked;
    double rounding;    // no computed distance is farther than that from what exact arithmetic gives, m
};

// The last body on whose branch two bodies are.
inline int common_of(const std::vector<Joint>& joints, int one, int two) {
    while (one != two) (one > two ? one : two) = joints[std::max(one, two) - 1].parent;
    return one;
}

struct Frame {
    Lanes rotation[9];
    Point origin;
};

INLINE Point turned(const Frame& frame, const double* v) {
    const Lanes* r = frame.rotation;
    return {r[0] * v[0] + r[1] * v[1] + r[2] * v[2], r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
            r[6] * v[0] + r[7] * v[1] + r[8] * v[2]};
}

INLINE Point placed(const Frame& frame, const double* p) { return turned(frame, p) + frame.origin; }

// Where everything is in eight postures. Centres of balls are computed when they are asked for.
class Eight {
public:
    explicit Eight(const World& world)
        : world(world), frames(world.dof + 1), centers_(world.nodes.size()), known_(world.nodes.size(), 0u),
          axes_(world.dof + 1), known_axes_(world.dof + 1, 0u) {
        for (int i = 0; i < 9; ++i) frames[0].rotation[i] = all(world.base_rotation[i]);
        frames[0].origin = {all(world.base_translation[0]), all(world.base_translation[1]),
                            all(world.base_translation[2])};
    }

    // Postures, one number of each joint after the other.
    void place(const Lanes* theta) {
        ++posture_;
        for (int k = 0; k < world.dof; ++k) {
            const Joint& joint = world.joints[k];
            const Frame& before = frames[joint.parent];
            Frame& frame = frames[k + 1];
            Lanes own[9];
            frame.origin = placed(before, joint.translation);
            if (joint.turns) {
                Lanes sine, cosine;
                sine_cosine(theta[k], sine, cosine);
                for (int i = 0; i < 9; ++i)
                    own[i] = joint.at[i] + (sine * joint.by_sine[i] + cosine * joint.by_cosine[i]);
            } else {
                for (int i = 0; i < 9; ++i) own[i] = all(joint.at[i]);
                const Point way = turned(before, joint.way);
                frame.origin = frame.origin + Point{way.x * theta[k], way.y * theta[k], way.z * theta[k]};
            }
            for (int row = 0; row < 9; row += 3)
                for (int column = 0; column < 3; ++column)
                    frame.rotation[row + column] = before.rotation[row] * own[column] +
                                                   before.rotation[row + 1] * own[3 + column] +
                                                   before.rotation[row + 2] * own[6 + column];
        }
    }

    // The direction of a joint's axis, the first joint being 1; computed once for a posture.
    const Point& known_axis(int joint) {
        if (known_axes_[joint] != posture_) {
            known_axes_[joint] = posture_;
            axes_[joint] = axis(joint);
        }
        return axes_[joint];
    }

    // How far a node may be from where it is seen, as seen from a body on whose branch it is, because joints are off by
    // their errors; of a node with others in it by so much more that it is no farther away than any of these.
    Lanes tube(int number, int from) {
        const Node& node = world.nodes[number];
        const Point& place = center(number);
        const double inner = node.count ? node.radius : 0.0;
        Lanes found = {};
        for (int joint = node.body; joint != from; joint = world.joints[joint - 1].parent) {
            const Lanes& error = errors[joint - 1];
            if (!world.joints[joint - 1].turns) {
                found += error;
                continue;
            }
            found += error * (length(cross(known_axis(joint), place - frames[joint].origin)) + inner);
        }
        return found * (1.0 + 1e-12);
    }

    const Point& center(int number) {
        if (known_[number] != posture_) {
            known_[number] = posture_;
            const Node& node = world.nodes[number];
            centers_[number] = placed(frames[node.body], node.center);
        }
        return centers_[number];
    }

    // The direction of a joint's axis, the first joint being 1.
    Point axis(int joint) const { return turned(frames[joint], world.joints[joint - 1].axis); }

    const World& world;
    std::vector<Frame> frames;      // of the base, and those that joints move
    const Drift* drifts = nullptr;  // of all solids; none where they stand still
    Lanes times = {};               // s, at which they are seen
    std::vector<Lanes> errors;      // of joints, how far each may be off, rad or m; none where they are where they are

private:
    std::vector<Point> centers_;
    std::vector<unsigned> known_;  // the posture in which each centre was computed
    std::vector<Point> axes_;
    std::vector<unsigned> known_axes_;  // likewise
    unsigned posture_ = 0;
};

// What two things keep: a node and a solid, or two nodes.
struct Item {
    int one, two, group;  // number of the solid or of the node, and of the group, which is negative for a solid
};

INLINE int kind(const Item& item) { return item.group < 0 ? 0 : 1; }

// The centre of a node from where a solid has moved to.
INLINE Point as_seen_from(const Drift& drift, Eight& eight, int node) {
    const Point& center = eight.center(node);
    return {center.x - (drift.origin[0] + drift.velocity[0] * eight.times),
            center.y - (drift.origin[1] + drift.velocity[1] * eight.times),
            center.z - (drift.origin[2] + drift.velocity[2] * eight.times)};
}

INLINE void put(double* numbers, const Lanes& lanes) {
    for (int lane = 0; lane < LANES; ++lane) numbers[lane] = lanes[lane];
}

// The distances of points at times from a solid that the core does not know.
inline Lanes asked_distances(const World& world, int solid, const Point& p, const Lanes& times) {
    double given[4 * LANES], found[LANES];
    put(given, p.x), put(given + LANES, p.y), put(given + 2 * LANES, p.z), put(given + 3 * LANES, times);
    world.asked.distances(solid, given, found);
    Lanes all_found;
    for (int lane = 0; lane < LANES; ++lane) all_found[lane] = found[lane];
    return all_found;
}

// How far they are apart, less what they have to keep: exact, or no more where it is more than enough, m.
INLINE Lanes room(Eight& eight, const Item& item, Lanes enough) {
    const World& world = eight.world;
    const Node& one = world.nodes[item.one];
    const double kept = world.margins[kind(item)];
    const bool exact = eight.errors.empty();
    if (item.group < 0) {
        const Drift* drift = eight.drifts ? &eight.drifts[item.two] : nullptr;
        Lanes more = drift ? one.radius + kept + drift->rate * eight.times : all(one.radius + kept);
        if (!exact) more += eight.tube(item.one, 0);
        if (world.solids[item.two].shape == ASKED)
            return asked_distances(world, item.two, eight.center(item.one), eight.times) - more;
        const Point center = drift ? as_seen_from(*drift, eight, item.one) : eight.center(item.one);
        return distance(world.solids[item.two], center, enough + more) - more;
    }
    const Node& two = world.nodes[item.two];
    const Lanes found = length(eight.center(item.one) - eight.center(item.two)) - (one.radius + two.radius + kept);
    if (exact) return found;
    const int common = world.groups[item.group].common;
    const Lanes off = found - eight.tube(item.one, common);
    return two.body == common ? off : off - eight.tube(item.two, common);
}

// The radius of what could be opened; zero of balls themselves.
INLINE double opening(const World& world, const Item& item) {
    const Node& one = world.nodes[item.one];
    if (item.group < 0) return one.count ? one.radius : 0.0;
    const Group& group = world.groups[item.group];
    const Node& two = world.nodes[item.two];
    if (group.begin < group.end) return item.one == group.one && item.two == group.two ? one.radius + two.radius : 0.0;
    return std::fmax(one.count ? one.radius : 0.0, two.count ? two.radius : 0.0);
}

// Put what an item holds, in smaller parts, on a stack.
template <class Stack>
inline void open(const World& world, const Item& item, Stack put) {
    const Node &one = world.nodes[item.one];
    if (item.group >= 0) {
        const Group& group = world.groups[item.group];
        if (group.begin < group.end) {
            for (int k = group.begin; k < group.end; ++k) put(Item{world.pairs[k].one, world.pairs[k].two, item.group});
            return;
        }
        const Node& two = world.nodes[item.two];
        const double first = one.count ? one.radius : 0.0, second = two.count ? two.radius : 0.0;
        if (first < second) {
            for (int k = 0; k < two.count; ++k) put(Item{item.one, two.first + k, item.group});
            return;
        }
    }
    for (int k = 0; k < one.count; ++k) put(Item{one.first + k, item.two, item.group});
}

// All that has to keep a distance: from solids, from each other.
enum Which { FROM_SOLIDS = 1, FROM_EACH_OTHER = 2 };

template <class Stack>
inline void roots(const World& world, unsigned which, Stack put) {
    if (which & FROM_EACH_OTHER)
        for (size_t k = 0; k < world.groups.size(); ++k) put(Item{world.groups[k].one, world.groups[k].two, (int)k});
    if (which & FROM_SOLIDS)
        for (const Pair& pair : world.watched) put(Item{pair.one, pair.two, -1});
}

}  // namespace core
