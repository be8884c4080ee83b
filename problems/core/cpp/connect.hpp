// A way between two postures: RRT-Connect (Kuffner and LaValle, 2000), then shortcuts.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace core {

// SplitMix64 (Steele, Lea and Flood, 2014).
class Random {
public:
    explicit Random(uint64_t seed) : state_(seed) {}
    double uniform() {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return (double)((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
    }

private:
    uint64_t state_;
};

struct Search {
    const double *lower, *upper;  // of the joints, rad
    double reach;                 // longest edge, rad
    int most;                     // extensions of a tree
    int shortcuts;
};

class Tree {
public:
    Tree(const double* root, int k) : k_(k), values_(root, root + k), parents_(1, -1) {}
    const double* at(int node) const { return &values_[(size_t)node * k_]; }
    int parent(int node) const { return parents_[node]; }
    int add(const double* theta, int parent) {
        values_.insert(values_.end(), theta, theta + k_);
        parents_.push_back(parent);
        return (int)parents_.size() - 1;
    }
    int nearest(const double* theta) const {
        int best = 0;
        double least = HUGE_VAL;
        for (size_t node = 0; node < parents_.size(); ++node) {
            const double* own = at((int)node);
            double square = 0.0;
            for (int j = 0; j < k_; ++j) square += (own[j] - theta[j]) * (own[j] - theta[j]);
            if (square < least) least = square, best = (int)node;
        }
        return best;
    }

private:
    int k_;
    std::vector<double> values_;
    std::vector<int> parents_;
};

// Args: `clear` says whether the straight way from one posture to another is, the first of them excluded.
template <class Clear>
class Connect {
public:
    Connect(int dof, const Search& search, uint64_t seed, Clear clear)
        : k_(dof), search_(search), clear_(std::move(clear)), random_(seed), next_(dof) {}

    // Postures one after the other from start to goal, with straight ways between them that were looked at; none where
    // no way was found.
    std::vector<double> operator()(const double* start, const double* goal) {
        Tree trees[2] = {Tree(start, k_), Tree(goal, k_)};
        std::vector<double> drawn(goal, goal + k_);
        for (int number = 0, side = 0; number < search_.most; ++number, side = 1 - side) {
            if (number)
                for (int j = 0; j < k_; ++j)
                    drawn[j] = search_.lower[j] + random_.uniform() * (search_.upper[j] - search_.lower[j]);
            const int own = extended(trees[side], drawn.data());
            if (own < 0) continue;
            const std::vector<double> toward(trees[side].at(own), trees[side].at(own) + k_);
            int other = -1;
            for (int node = 0; node >= 0;) {
                node = extended(trees[1 - side], toward.data());
                if (node >= 0) other = node;
                if (node >= 0 && std::equal(toward.begin(), toward.end(), trees[1 - side].at(node)))
                    return shortened(joined(trees, side ? other : own, side ? own : other));
            }
        }
        return {};
    }

    // A path with straight ways between two of its points drawn at random, where they are clear.
    std::vector<double> shortened(std::vector<double> path) {
        for (int number = 0; number < search_.shortcuts && (int)path.size() > 2 * k_; ++number) {
            const int last = (int)path.size() / k_ - 1;
            double first = random_.uniform() * last, second = random_.uniform() * last;
            if (second < first) std::swap(first, second);
            const int before = (int)first, after = (int)second;
            if (before == after) continue;
            const std::vector<double> one = between(path, first), two = between(path, second);
            if (!clear_(one.data(), two.data())) continue;
            std::vector<double> found(path.begin(), path.begin() + (size_t)(before + 1) * k_);
            found.insert(found.end(), one.begin(), one.end());
            found.insert(found.end(), two.begin(), two.end());
            found.insert(found.end(), path.begin() + (size_t)(after + 1) * k_, path.end());
            path.swap(found);
        }
        return path;
    }

private:
    // A new node at a posture, or as far toward it as an edge may reach; negative where the way is not clear.
    int extended(Tree& tree, const double* toward) {
        const int near = tree.nearest(toward);
        const double* from = tree.at(near);
        double square = 0.0;
        for (int j = 0; j < k_; ++j) square += (toward[j] - from[j]) * (toward[j] - from[j]);
        const double way = std::sqrt(square), share = way > search_.reach ? search_.reach / way : 1.0;
        if (way == 0.0) return near;
        for (int j = 0; j < k_; ++j) next_[j] = share < 1.0 ? from[j] + share * (toward[j] - from[j]) : toward[j];
        return clear_(from, next_.data()) ? tree.add(next_.data(), near) : -1;
    }

    std::vector<double> joined(const Tree* trees, int first, int second) const {
        std::vector<double> path;
        std::vector<int> chain;
        for (int node = first; node >= 0; node = trees[0].parent(node)) chain.push_back(node);
        for (size_t k = chain.size(); k-- > 0;) {
            const double* node = trees[0].at(chain[k]);
            path.insert(path.end(), node, node + k_);
        }
        for (int node = trees[1].parent(second); node >= 0; node = trees[1].parent(node))
            path.insert(path.end(), trees[1].at(node), trees[1].at(node) + k_);
        return path;
    }

    std::vector<double> between(const std::vector<double>& path, double place) const {
        const int last = (int)path.size() / k_ - 1, before = std::min((int)place, last - 1);
        std::vector<double> found(k_);
        for (int j = 0; j < k_; ++j) {
            const double a = path[(size_t)before * k_ + j], b = path[(size_t)(before + 1) * k_ + j];
            found[j] = a + (place - before) * (b - a);
        }
        return found;
    }

    const int k_;
    const Search search_;
    Clear clear_;
    Random random_;
    std::vector<double> next_;
};

}  // namespace core
