// What Python calls of dynamics: states in, torques and their slopes out.
#include "newton_euler.hpp"
#include "reader.hpp"

namespace core {
namespace {

Chain chain_of(Reader reader) {
    Chain chain;
    chain.bodies.resize(reader.count());
    reader.fill(chain.gravity, 3);
    for (Body& body : chain.bodies) {
        body.joint = joint_of(reader);
        reader.fill(&body.mass, 1);
        reader.fill(body.first, 3);
        reader.fill(body.second, 9);
    }
    return chain;
}

}  // namespace
}  // namespace core

using namespace core;

extern "C" {

Chain* core_chain(const long long* counts, const double* numbers) { return new Chain(chain_of({counts, numbers})); }

void core_forget_chain(Chain* chain) { delete chain; }

// Torques in states (rows, 3 k): of inertia and of gravity, (rows, k) each.
void core_torques(const Chain* chain, int rows, const double* states, double* inertial, double* held) {
    const int k = (int)chain->bodies.size();
    NewtonEuler<Lanes> moving(*chain), still(*chain);
    std::vector<Lanes> lanes;
    for (int row = 0; row < rows; row += LANES) {
        const int count = gathered(states, rows, row, 3 * k, moving.state);
        std::copy(moving.state.begin(), moving.state.begin() + k, still.state.begin());
        moving.compute(0.0);
        still.compute(1.0);
        for (int lane = 0; lane < count; ++lane)
            for (int j = 0; j < k; ++j) {
                inertial[(size_t)(row + lane) * k + j] = moving.torques[j][lane];
                held[(size_t)(row + lane) * k + j] = still.torques[j][lane];
            }
    }
}

// How the torques of both together change with angles, velocities and accelerations: (rows, k, 3, k).
void core_torque_slopes(const Chain* chain, int rows, const double* states, double* slopes) {
    const int k = (int)chain->bodies.size();
    NewtonEuler<Sloped> moving(*chain);
    std::vector<Lanes> lanes;
    for (int row = 0; row < rows; row += LANES) {
        const int count = gathered(states, rows, row, 3 * k, lanes);
        for (int j = 0; j < 3 * k; ++j) moving.state[j] = {lanes[j], Lanes{}};
        for (int by = 0; by < 3 * k; ++by) {
            moving.state[by].slope = all(1.0);
            moving.compute(1.0);
            moving.state[by].slope = Lanes{};
            for (int lane = 0; lane < count; ++lane)
                for (int j = 0; j < k; ++j)
                    slopes[((size_t)(row + lane) * k + j) * 3 * k + by] = moving.torques[j].slope[lane];
        }
    }
}
}
