// Postures of an arm that reach poses of the tool: those to which Newton steps lead from given starts.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "reach.hpp"

namespace core {

// Joints whose turns all lead to the same place are taken in the turn nearest to a posture, within their range.
struct JointTurns {
    const double *low, *high, *near;
    const int* winding;  // whether any angle has a turn within the range
};

struct InverseSearch {
    int starts, steps;
    const double* from;  // (starts, k)
    double tolerance;    // m and rad, of a posture that reaches its pose
    double apart;        // rad or m in some joint, of two postures
};

class Inverse {
public:
    // As of `Reach`.
    Inverse(const World& arm, int carrier, const double* tool, const std::vector<Target>& targets, bool turned,
            const JointTurns& joints, const InverseSearch& search)
        : k_(arm.dof), targets_(targets), joints_(joints), search_(search), lower_(joints.low, joints.low + k_),
          upper_(joints.high, joints.high + k_), reach_(arm, carrier, tool, turned, lower_.data(), upper_.data()),
          last_(arm, carrier, tool, turned, lower_.data(), upper_.data()), theta_(k_), ended_(k_) {
        for (int j = 0; j < k_; ++j)
            if (joints.winding[j]) lower_[j] = -HUGE_VAL, upper_[j] = HUGE_VAL;
    }

    // Postures of one target after the other, each of those that are alike up to whole turns once, in the order of the
    // starts, each with its manipulability as one more number; how many there are of each.
    std::vector<double> operator()(int* counts) {
        for (int lane = 0; lane < LANES; ++lane) begin(lane);
        Mask fresh = going_;  // what has just begun is looked at before it steps
        while (bits(going_)) {
            const Lanes missing = reach_.look(theta_.data());
            for (int lane = 0; lane < LANES; ++lane)
                if (going_[lane] && is_done(lane, missing[lane])) {
                    if (missing[lane] <= 2.0 * search_.tolerance) end(lane);
                    begin(lane);
                    fresh[lane] = -1;
                } else {
                    fresh[lane] = 0;
                }
            reach_.step(theta_.data(), missing, going_ & ~fresh);
        }
        settle();
        std::sort(found_.begin(), found_.end());
        return distinct(counts);
    }

private:
    static constexpr double TURN = 6.283185307179586;
    using Number = std::pair<int, int>;  // of the target, and of the start

    // The next start in a lane; none where there is no other.
    void begin(int lane) {
        going_[lane] = next_.first < (int)targets_.size() ? -1 : 0;
        if (!going_[lane]) return;
        numbers_[lane] = next_;
        age_[lane] = 0, before_[lane] = HUGE_VAL;
        reach_.aim(lane, targets_[next_.first]);
        for (int j = 0; j < k_; ++j) theta_[j][lane] = search_.from[(size_t)next_.second * k_ + j];
        if (++next_.second == search_.starts) next_ = {next_.first + 1, 0};
    }

    bool is_done(int lane, double missing) {
        if (age_[lane] % Reach::PATIENCE == 0) {
            if (!(missing < (1.0 - Reach::LEAST_GAIN) * before_[lane])) return true;
            before_[lane] = missing;
        }
        return !(missing > Reach::CONVERGED) || age_[lane]++ == search_.steps;
    }

    // Keep what a lane has come to: eight at a time are turned, and looked at as they are then.
    void end(int lane) {
        last_.aim(count_, targets_[numbers_[lane].first]);
        ended_numbers_[count_] = numbers_[lane];
        for (int j = 0; j < k_; ++j) ended_[j][count_] = turned(j, theta_[j][lane]);
        if (++count_ == LANES) settle();
    }

    void settle() {
        Mask kept = last_.arrived(ended_.data(), search_.tolerance);
        for (int j = 0; j < k_; ++j) kept &= (ended_[j] >= joints_.low[j]) & (ended_[j] <= joints_.high[j]);
        const Lanes measure = last_.manipulability();
        for (int lane = 0; lane < count_; ++lane) {
            if (!kept[lane]) continue;
            found_.push_back({ended_numbers_[lane], (int)values_.size()});
            for (int j = 0; j < k_; ++j) values_.push_back(ended_[j][lane]);
            values_.push_back(measure[lane]);
        }
        count_ = 0;
    }

    double turned(int joint, double angle) const {
        if (!joints_.winding[joint]) return angle;
        double found = angle - TURN * std::nearbyint((angle - joints_.near[joint]) / TURN);
        if (found > joints_.high[joint]) found -= TURN * std::ceil((found - joints_.high[joint]) / TURN);
        if (found < joints_.low[joint]) found += TURN * std::ceil((joints_.low[joint] - found) / TURN);
        return found;
    }

    std::vector<double> distinct(int* counts) const {
        std::vector<double> kept;
        size_t begin = 0;
        std::fill(counts, counts + targets_.size(), 0);
        for (size_t number = 0; number < found_.size(); ++number) {
            const auto& [which, place] = found_[number];
            if (number && which.first != found_[number - 1].first.first) begin = kept.size();
            if (!is_new(&values_[place], kept, begin)) continue;
            kept.insert(kept.end(), &values_[place], &values_[place] + k_ + 1);
            ++counts[which.first];
        }
        return kept;
    }

    bool is_new(const double* theta, const std::vector<double>& kept, size_t begin) const {
        for (size_t other = begin; other < kept.size(); other += k_ + 1) {
            double most = 0.0;
            for (int j = 0; j < k_; ++j) {
                double way = std::fabs(theta[j] - kept[other + j]);
                if (joints_.winding[j]) way = std::fabs(way - TURN * std::nearbyint(way / TURN));
                most = std::max(most, way);
            }
            if (!(most > search_.apart)) return false;
        }
        return true;
    }

    const int k_;
    const std::vector<Target>& targets_;
    const JointTurns joints_;
    const InverseSearch search_;
    std::vector<double> lower_, upper_;
    Reach reach_, last_;
    std::vector<Lanes> theta_, ended_;
    Number next_ = {0, 0};
    std::array<Number, LANES> numbers_, ended_numbers_;
    Mask going_ = {};
    int age_[LANES] = {}, count_ = 0;
    double before_[LANES] = {};
    std::vector<std::pair<Number, int>> found_;  // and where its values begin
    std::vector<double> values_;
};

}  // namespace core
