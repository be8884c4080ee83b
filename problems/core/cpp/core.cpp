// What Python calls: arrays in, arrays out.
#include <algorithm>
#include <memory>
#include <vector>

#include "branchwise.hpp"
#include "inverse.hpp"
#include "proof.hpp"
#include "reader.hpp"
#include "rooms.hpp"

#define AS_TEXT(number) #number
#define DOTTED(major, minor, patch) AS_TEXT(major) "." AS_TEXT(minor) "." AS_TEXT(patch)
#if defined(__apple_build_version__)
#define COMPILER "Apple Clang " DOTTED(__clang_major__, __clang_minor__, __clang_patchlevel__)
#elif defined(__clang__)
#define COMPILER "Clang " DOTTED(__clang_major__, __clang_minor__, __clang_patchlevel__)
#else
#define COMPILER "GCC " DOTTED(__GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__)
#endif
#if defined(__AVX512F__)
#define INSTRUCTIONS "AVX-512"
#elif defined(__AVX2__)
#define INSTRUCTIONS "AVX2"
#else
#define INSTRUCTIONS "any processor of its kind"
#endif

namespace core {
namespace {

Solid solid_of(Reader& reader) {
    Solid solid{};
    solid.shape = (Shape)reader.count();
    const int planes = reader.count(), faces = reader.count(), edges = reader.count();
    reader.fill(solid.axes, 9);
    reader.fill(solid.center, 3);
    reader.fill(solid.sizes, 3);
    solid.planes = reader.list(4 * planes);
    solid.faces = reader.list(4 * faces);
    solid.edges = reader.list(6 * edges);
    return solid;
}

World world_of(Reader reader) {
    World world;
    world.dof = reader.count();
    const int nodes = reader.count(), watched = reader.count(), groups = reader.count(), pairs = reader.count(),
              solids = reader.count();
    reader.fill(world.base_rotation, 9);
    reader.fill(world.base_translation, 3);
    reader.fill(world.margins, 2);
    reader.fill(&world.rounding, 1);
    for (int k = 0; k < world.dof; ++k) world.joints.push_back(joint_of(reader));
    for (int k = 0; k < nodes; ++k) {
        Node node{};
        node.body = reader.count(), node.first = reader.count(), node.count = reader.count();
        reader.fill(node.center, 3);
        reader.fill(&node.radius, 1);
        world.nodes.push_back(node);
    }
    const auto pair = [&reader] {
        const int one = reader.count();
        return Pair{one, reader.count()};
    };
    for (int k = 0; k < watched; ++k) world.watched.push_back(pair());
    for (int k = 0; k < groups; ++k) {
        const Pair own = pair(), range = pair();
        const int common = common_of(world.joints, world.nodes[own.one].body, world.nodes[own.two].body);
        world.groups.push_back({own.one, own.two, range.one, range.two, common});
    }
    for (int k = 0; k < pairs; ++k) world.pairs.push_back(pair());
    for (int k = 0; k < solids; ++k) world.solids.push_back(solid_of(reader));
    return world;
}

// An array of numbers (solids, 7) as drifts.
const Drift* moving(const double* drifts) {
    static_assert(sizeof(Drift) == 7 * sizeof(double), "an array of numbers is an array of drifts");
    return reinterpret_cast<const Drift*>(drifts);
}

// Postures that are looked at, (rows, k); how solids move, (solids, 7), and at which times (rows,), or null for both; how
// far joints may be off, (rows, k), or null.
struct Looked {
    int rows;
    const double *theta, *drifts, *times, *errors;
};

// As `gathered`, placed.
int placed_at(Eight& eight, const Looked& looked, int row, std::vector<Lanes>& lanes) {
    const int k = eight.world.dof, rows = looked.rows, count = gathered(looked.theta, rows, row, k, lanes);
    eight.place(lanes.data());
    eight.drifts = moving(looked.drifts);
    if (looked.errors) gathered(looked.errors, rows, row, k, eight.errors);
    for (int lane = 0; looked.times && lane < LANES; ++lane)
        eight.times[lane] = looked.times[std::min(row + lane, rows - 1)];
    return count;
}

// How many postures there are, of which at most `capacity` are written.
int written(const std::vector<double>& found, int k, int capacity, double* path) {
    const int count = (int)found.size() / k;
    std::copy(found.begin(), found.begin() + (size_t)std::min(count, capacity) * k, path);
    return count;
}

Target target_of(const double* position, const double* rotation) {
    Target target{};
    std::copy(position, position + 3, target.position);
    if (rotation) std::copy(rotation, rotation + 9, target.rotation);
    return target;
}

}  // namespace
}  // namespace core

using namespace core;

extern "C" {

// Of the sources of which this was made.
const char* core_digest() {
#if defined(CORE_DIGEST)
    return CORE_DIGEST;
#else
    return "";
#endif
}

// By which compiler this was made, and for which instructions.
const char* core_made() { return COMPILER " for " INSTRUCTIONS; }

// The best variant that this processor runs: 2 with AVX-512, 1 with AVX2, else 0.
int core_variant() {
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return 2;
    if (__builtin_cpu_supports("avx2")) return 1;
#endif
    return 0;
}

// The world of a description; of solids that are not in it, those who know them are asked.
World* core_world(const long long* counts, const double* numbers,
                  void (*distances)(int solid, const double* points, double* found),
                  void (*travel)(int solid, const double* cells, double* found)) {
    World* world = new World(world_of({counts, numbers}));
    world->asked = {distances, travel};
    return world;
}

void core_forget(World* world) { delete world; }

// The room of postures, at most what `found` (rows,) holds at first.
void core_rooms(const World* world, unsigned which, int first_hit, int rows, const double* theta, const double* drifts,
                const double* times, const double* errors, double* found) {
    const Looked looked{rows, theta, drifts, times, errors};
    Rooms rooms(*world);
    std::vector<Lanes> lanes;
    for (int row = 0; row < rows; row += LANES) {
        const int count = placed_at(rooms.eight, looked, row, lanes);
        Lanes most;
        for (int lane = 0; lane < LANES; ++lane) most[lane] = found[row + std::min(lane, count - 1)];
        const Lanes least = rooms.least_of(most, which, first_hit != 0);
        for (int lane = 0; lane < count; ++lane) found[row + lane] = least[lane];
    }
}

// What has less room than is given in postures: how much there is, of which at most `capacity` is written: number of the posture and kind (0 from solids, 1 from each other), (n, 2); room, how
// it changes with the time, and with the joints, (n, 2 + k).
int core_nearest(const World* world, unsigned which, double given, int rows, const double* theta, const double* drifts,
                 const double* times, const double* errors, int capacity, int* places, double* values) {
    const Looked looked{rows, theta, drifts, times, errors};
    Nearest nearest(*world);
    std::vector<Lanes> lanes;
    const int k = world->dof;
    int told = 0;
    for (int row = 0; row < rows; row += LANES) {
        const int count = placed_at(nearest.eight, looked, row, lanes);
        nearest.below(given, which, count, [&](int lane, int kind, double room, double rate, const double* gradient) {
            if (told < capacity) {
                double* own = values + (size_t)told * (2 + k);
                places[2 * told] = row + lane;
                places[2 * told + 1] = kind;
                own[0] = room, own[1] = rate;
                std::copy(gradient, gradient + k, own + 2);
            }
            ++told;
        });
    }
    return told;
}

// What is nearest of all in each posture: node, solid or node, kind, (rows, 3), the first of them negative where there is
// nothing; room and the nearest points of both surfaces, (rows, 7).
void core_closest(const World* world, unsigned which, int rows, const double* theta, const double* drifts,
                  const double* times, const double* errors, int* places, double* values) {
    const Looked looked{rows, theta, drifts, times, errors};
    Nearest nearest(*world);
    std::vector<Lanes> lanes;
    std::fill(places, places + 3 * (size_t)rows, -1);
    for (int row = 0; row < rows; row += LANES) {
        const int count = placed_at(nearest.eight, looked, row, lanes);
        nearest.of_all(which, count, [&](int lane, const Item& item, double room, const double* points) {
            int* place = places + 3 * (size_t)(row + lane);
            double* own = values + 7 * (size_t)(row + lane);
            place[0] = item.one, place[1] = item.two, place[2] = kind(item);
            own[0] = room;
            std::copy(points, points + 6, own + 1);
        });
    }
}

// Room of a motion for all t, where solids move as `drifts` (solids, 7) say, if that is not null, and distances are off
// by `rounding` more then, and joints may be off as `tracking` (3, k) says, if that is not null: a constant, shares of
// speed and acceleration; values: proven, smallest, time of that, start and end of a cell that is not known; places: node, solid or node, kind.
int core_prove(const World* world, unsigned which, double gap, int cells, long long most, int pieces, int order,
               const double* breaks, const double* coefficients, const double* drifts, double rounding,
               const double* tracking, double* values, int* places) {
    const Motion motion{pieces, order, breaks, coefficients};
    const Proof proof = Prover(*world, motion, moving(drifts), rounding, tracking)(which, gap, cells, most);
    values[0] = proof.proven, values[1] = proof.smallest, values[2] = proof.time;
    values[3] = proof.start, values[4] = proof.end;
    places[0] = proof.where.one, places[1] = proof.where.two, places[2] = kind(proof.where);
    return proof.status;
}

// A way of at most `capacity` postures (m, k) from start to goal: how many there are, 0 where none was found. Edges are
// looked at with so much step, rad of the joint that turns most, and keep the room that is given, m. Solids move as
// `drifts` (solids, 7) say, and postures are passed when `schedule` (k + 3,) says, if both are not null: slopes, offset,
// first and last time. Joints may be off by `errors` (k,), if that is not null. Groups of joints go one after the other
// in their turns (k,), if that is not null, else all at once.
int core_connect(const World* world, const double* start, const double* goal, const double* lower, const double* upper,
                 double step, double given, double reach, int most, int shortcuts, unsigned long long seed,
                 const double* drifts, const double* schedule, const double* errors, const int* turns, int capacity,
                 double* path) {
    const int k = world->dof;
    Rooms rooms(*world);
    rooms.eight.drifts = moving(drifts);
    for (int j = 0; errors && j < k; ++j) rooms.eight.errors.push_back(all(errors[j]));
    Schedule passed{};
    if (schedule) {
        const double* rest = schedule + k;
        passed = {schedule, rest[0], rest[1], rest[2]};
        rooms.schedule = &passed;
    }
    const auto clear = [&](const double* from, const double* to) {
        return rooms.clear_between(from, to, step, given, FROM_SOLIDS | FROM_EACH_OTHER);
    };
    const Search search{lower, upper, reach, most, shortcuts};
    if (turns) return written(Branchwise({turns, turns + k}, search, seed, clear)(start, goal), k, capacity, path);
    return written(Connect(k, search, seed, clear)(start, goal), k, capacity, path);
}

// The same among surroundings that the core does not know: `clear` is asked.
int core_connect_asking(int k, const double* start, const double* goal, const double* lower, const double* upper,
                        double reach, int most, int shortcuts, unsigned long long seed,
                        int (*clear)(const double* from, const double* to), int capacity, double* path) {
    return written(Connect(k, {lower, upper, reach, most, shortcuts}, seed, clear)(start, goal), k, capacity, path);
}

// Where steps lead from postures (rows, k), which are replaced, to a pose of the tool; what each then lacks, (rows,).
void core_reach(const World* arm, int carrier, const double* tool, const double* position, const double* rotation, int turned,
                const double* lower, const double* upper, int steps, int rows, double* theta, double* missing) {
    const Target target = target_of(position, turned ? rotation : nullptr);
    Reach reach(*arm, carrier, tool, turned != 0, lower, upper);
    for (int lane = 0; lane < LANES; ++lane) reach.aim(lane, target);
    std::vector<Lanes> lanes;
    const int k = arm->dof;
    for (int row = 0; row < rows; row += LANES) {
        const int count = gathered(theta, rows, row, k, lanes);
        const Lanes left = reach(lanes.data(), steps);
        for (int lane = 0; lane < count; ++lane) {
            missing[row + lane] = left[lane];
            for (int j = 0; j < k; ++j) theta[(size_t)(row + lane) * k + j] = lanes[j][lane];
        }
    }
}

// Postures and their manipulability (n, k + 1) that reach poses, to which so many steps lead from starts (starts, k), one pose
// after the other: how many there are in all, of which at most `capacity` are written, and of each pose, (poses,).
int core_inverse(const World* arm, int carrier, const double* tool, int poses, const double* positions,
                 const double* rotations, const double* low, const double* high, const int* winding, const double* near,
                 int starts, const double* from, int steps, double tolerance, double apart, int capacity, int* counts,
                 double* found) {
    std::vector<Target> targets;
    for (int pose = 0; pose < poses; ++pose)
        targets.push_back(target_of(positions + 3 * pose, rotations ? rotations + 9 * pose : nullptr));
    const JointTurns joints{low, high, near, winding};
    const InverseSearch search{starts, steps, from, tolerance, apart};
    return written(Inverse(*arm, carrier, tool, targets, rotations != nullptr, joints, search)(counts), arm->dof + 1,
                   capacity, found);
}
}
