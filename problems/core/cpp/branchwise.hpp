// A way of several branches: each group of joints goes its own way while the others stand, and two ways are gone at the
// same time as far as a diagram of progress allows (O'Donnell and Lozano-Perez, 1989).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>
#include <utility>
#include <vector>

#include "connect.hpp"

namespace core {

constexpr int STEPS = 32;  // of the longer of two ways, at least

// A way of postures that are close together, and how much is left of it after each, in rad of the joint that turns most.
struct Steps {
    std::vector<double> postures, left;
    int last() const { return (int)left.size() - 1; }
};

// Args: as of `Connect`; `turns` has the number of the group of each joint, which is also when its way is looked for.
template <class Clear>
class Branchwise {
public:
    Branchwise(std::vector<int> turns, const Search& search, uint64_t seed, Clear clear)
        : k_((int)turns.size()), turns_(std::move(turns)), search_(search), seed_(seed), clear_(std::move(clear)) {}

    // As of `Connect`. Groups that had their turn stand at the goal, the others at the start.
    std::vector<double> operator()(const double* start, const double* goal) {
        std::vector<double> path(start, start + k_), at(path);
        for (int turn = 0; turn <= *std::max_element(turns_.begin(), turns_.end()); ++turn) {
            const std::vector<double> own = own_way(turn, at, goal);
            if (own.empty()) return {};
            path = together(path, own, turn);
            for (int j = 0; j < k_; ++j)
                if (turns_[j] == turn) at[j] = goal[j];
        }
        return Connect(k_, search_, seed_, clear_).shortened(std::move(path));
    }

private:
    // The way of one group, as whole postures, while the other joints stand.
    std::vector<double> own_way(int turn, const std::vector<double>& at, const double* goal) {
        std::vector<int> joints;
        std::vector<double> ends[2], box[2];
        for (int j = 0; j < k_; ++j) {
            if (turns_[j] != turn) continue;
            joints.push_back(j);
            ends[0].push_back(at[j]), ends[1].push_back(goal[j]);
            box[0].push_back(search_.lower[j]), box[1].push_back(search_.upper[j]);
        }
        const int count = (int)joints.size();
        const auto put = [&](const double* own, double* whole) {
            for (int i = 0; i < count; ++i) whole[joints[i]] = own[i];
        };
        std::vector<double> from(at), to(at);
        const auto clear = [&](const double* one, const double* two) {
            put(one, from.data()), put(two, to.data());
            return clear_(from.data(), to.data());
        };
        Search search = search_;
        search.lower = box[0].data(), search.upper = box[1].data();
        const std::vector<double> own = Connect(count, search, seed_, clear)(ends[0].data(), ends[1].data());
        std::vector<double> path;
        for (size_t first = 0; first < own.size(); first += count) {
            put(&own[first], from.data());
            path.insert(path.end(), from.begin(), from.end());
        }
        return path;
    }

    // Two ways gone at the same time: the shortest way through their diagram of progress, of which two sides are known
    // to be clear: the first way before the second begins, and the second after that.
    std::vector<double> together(const std::vector<double>& first, const std::vector<double>& second, int turn) {
        const double step = std::max(length(first), length(second)) / STEPS;
        const Steps one = in_steps(first, step), two = in_steps(second, step);
        const int width = two.last() + 1, count = (one.last() + 1) * width;
        std::vector<double> gone(count, HUGE_VAL);
        std::vector<int> before(count, -1);
        std::vector<bool> closed(count, false);
        using Open = std::pair<double, int>;  // as long as a way past a node is at least; of two, that which is farther
        std::priority_queue<Open, std::vector<Open>, std::greater<Open>> open;
        const auto reached = [&](int node, int from, double way) {
            if (!(way < gone[node])) return;
            gone[node] = way, before[node] = from;
            open.push({way + std::max(one.left[node / width], two.left[node % width]), -node});
        };
        reached(0, -1, 0.0);
        while (!closed[count - 1]) {
            const int node = -open.top().second, i = node / width, j = node % width;
            open.pop();
            if (closed[node]) continue;
            closed[node] = true;
            for (const auto& [down, right] : {std::pair{1, 1}, {1, 0}, {0, 1}}) {
                if (i + down > one.last() || j + right > two.last()) continue;
                const int next = node + down * width + right;
                const double way = std::max(one.left[i] - one.left[i + down], two.left[j] - two.left[j + right]);
                const bool known = (j == 0 && !right) || (i == one.last() && !down);
                if (!closed[next] && gone[node] + way < gone[next] &&
                    (known || clear_(at(one, i, two, j, turn).data(), at(one, i + down, two, j + right, turn).data())))
                    reached(next, node, gone[node] + way);
            }
        }
        std::vector<int> nodes;
        for (int node = count - 1; node >= 0; node = before[node]) nodes.push_back(node);
        std::vector<double> path;
        for (size_t n = nodes.size(); n-- > 0;) {
            const std::vector<double> theta = at(one, nodes[n] / width, two, nodes[n] % width, turn);
            path.insert(path.end(), theta.begin(), theta.end());
        }
        return path;
    }

    // A posture of the first way, with the joints of a group as they are in one of the second.
    std::vector<double> at(const Steps& one, int i, const Steps& two, int j, int turn) const {
        std::vector<double> theta(&one.postures[(size_t)i * k_], &one.postures[(size_t)i * k_] + k_);
        for (int joint = 0; joint < k_; ++joint)
            if (turns_[joint] == turn) theta[joint] = two.postures[(size_t)j * k_ + joint];
        return theta;
    }

    double apart(const double* one, const double* two) const {
        double most = 0.0;
        for (int j = 0; j < k_; ++j) most = std::max(most, std::fabs(two[j] - one[j]));
        return most;
    }

    double length(const std::vector<double>& path) const {
        double sum = 0.0;
        for (size_t next = k_; next < path.size(); next += k_) sum += apart(&path[next - k_], &path[next]);
        return sum;
    }

    // A way with all its bends, and postures between them that are no farther apart than a step.
    Steps in_steps(const std::vector<double>& path, double step) const {
        Steps found{{path.begin(), path.begin() + k_}, {0.0}};
        for (size_t next = k_; next < path.size(); next += k_) {
            const double *one = &path[next - k_], *two = &path[next], way = apart(one, two);
            const int count = std::max(1, (int)std::ceil(way / step - 1e-9));
            for (int n = 1; n <= count && way > 0.0; ++n) {
                for (int j = 0; j < k_; ++j) found.postures.push_back(one[j] + n * (two[j] - one[j]) / count);
                found.left.push_back(found.left.back() - way / count);
            }
        }
        const double all = -found.left.back();
        for (double& each : found.left) each += all;
        return found;
    }

    const int k_;
    const std::vector<int> turns_;
    const Search search_;
    const uint64_t seed_;
    Clear clear_;
};

}  // namespace core
