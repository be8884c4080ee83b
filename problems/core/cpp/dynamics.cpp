// What Python calls of dynamics: states in, torques and their slopes out; a motion in, a proof of its torques out.
#include "bisection.hpp"
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

// Friction of each joint: viscous, N m s, and Coulomb's, N m; the largest torques, N m; speeds up to which it may stand.
struct Motors {
    const double *damping, *friction, *largest, *still;
};

// Shares of the largest torques. Coulomb's friction is anything between its two where a joint may stand still.
class TorqueShares {
public:
    TorqueShares(const Chain& chain, const Motors& motors)
        : k_((int)chain.bodies.size()), motors_(motors), numbers_(chain), models_(chain) {}

    Lanes seen(const State<Lanes>& state) {
        numbers_.state = state.joints;
        numbers_.compute(1.0);
        Largest share;
        for (int j = 0; j < k_; ++j) {
            const Lanes& speed = state.joints[k_ + j];
            const Lanes torque = numbers_.torques[j] + motors_.damping[j] * speed, rubs = all(motors_.friction[j]);
            const Lanes low = torque + chosen(speed > motors_.still[j], rubs, -rubs);
            const Lanes high = torque + chosen(speed < -motors_.still[j], -rubs, rubs);
            share.add(high / motors_.largest[j]);
            share.add(-low / motors_.largest[j]);
        }
        return share.value();
    }

    Lanes bound(const State<Model>& state, Lanes& where) {
        models_.state = state.joints;
        models_.compute(1.0);
        Largest share;
        for (int j = 0; j < k_; ++j) {
            const Model& speed = state.joints[k_ + j];
            const Model torque = models_.torques[j] + motors_.damping[j] * speed;
            const Lanes rubs = all(motors_.friction[j]);
            const Lanes high = top(torque) + chosen(top(speed) < 0.0, -rubs, rubs);
            const Lanes low = top(-torque) + chosen(top(-speed) < 0.0, -rubs, rubs);
            for (int side : {0, 1}) {
                const Lanes own = side ? high : low;
                const Mask larger = share.add((own + ROUNDED * size(own)) / motors_.largest[j]);
                where = chosen(larger, likely(side ? torque : -torque), where);
            }
        }
        return share.value();
    }

private:
    const int k_;
    const Motors motors_;
    NewtonEuler<Lanes> numbers_;
    NewtonEuler<Model> models_;
};

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

// Whether torques stay within the largest ones, as in `Found`; moments are pieces and offsets, (n,). Written are the
// largest share, when in its piece, and a cell; as many broken moments as there is room for. `step` is as for expressions.
int core_prove_torques(const Chain* chain, const double* damping, const double* friction, const double* largest,
                       const double* still, int pieces, int order, const double* breaks, const double* coefficients,
                       double allowed, double gap, double least, int first_cells, long long most_cells, double step, int n,
                       const int* at_pieces, const double* offsets, double* found, int capacity, int* broken_pieces,
                       double* broken_offsets) {
    Polynomials polynomials({pieces, order, breaks, coefficients}, (int)chain->bodies.size(), 3);
    TorqueShares question(*chain, {damping, friction, largest, still});
    std::vector<Moment> moments;
    for (int i = 0; i < n; ++i) moments.push_back({at_pieces[i], offsets[i]});
    const Aim aim{allowed, gap, least, first_cells, most_cells};
    const Found result = Bisection<TorqueShares>(polynomials, question, aim)(moments, step);
    const int count = std::min((int)result.broken.size(), capacity);
    for (int i = 0; i < count; ++i)
        broken_pieces[i] = result.broken[i].piece, broken_offsets[i] = result.broken[i].offset;
    const double values[] = {result.share, (double)result.moment.piece, result.moment.offset, result.start, result.end,
                             (double)count};
    std::copy(values, values + 6, found);
    return result.status;
}
}
