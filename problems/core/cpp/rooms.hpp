// How much room postures have: the least distance from anything that has to be kept, less what has to be kept.
#pragma once
#include <algorithm>
#include <vector>

#include "world.hpp"

namespace core {

// When postures are passed, about: as far as they are along a straight way.
struct Schedule {
    const double* slopes;  // of the joints, s/rad
    double offset, first, last;  // s: of the postures whose angles are zero; no time is before or after these

    Lanes passing(const std::vector<Lanes>& theta) const {
        Lanes time = all(offset);
        for (size_t j = 0; j < theta.size(); ++j) time += slopes[j] * theta[j];
        return least(most(time, all(first)), all(last));
    }
};

class Rooms {
public:
    explicit Rooms(const World& world) : eight(world), world_(world) {}

    // The least room of the postures that are placed, where that is less than what is given; where only that matters,
    // nothing more is looked at once it is known of every lane.
    Lanes least_of(Lanes found, unsigned which, bool first_hit = false) {
        const Lanes given = found;
        stack_.clear();
        roots(world_, which, [this](const Item& item) { stack_.push_back(item); });
        while (!stack_.empty()) {
            const Item item = stack_.back();
            stack_.pop_back();
            const Lanes here = room(eight, item, found);
            if (!bits(~(here >= found))) continue;
            if (opening(world_, item) > 0.0) {
                open(world_, item, [this](const Item& part) { stack_.push_back(part); });
                continue;
            }
            found = chosen(here >= found, found, here);
            if (first_hit && bits(~(found >= given)) == EVERY_LANE) break;
        }
        return found;
    }

    // Whether all postures between two, the first of them excluded, have more room than is given.
    bool clear_between(const double* from, const double* to, double step, double given, unsigned which) {
        const int k = world_.dof;
        double way = 0.0;
        for (int j = 0; j < k; ++j) way = std::max(way, std::fabs(to[j] - from[j]));
        const int count = std::max(1, (int)std::ceil(way / step)), batches = (count + LANES - 1) / LANES;
        theta_.resize(k);
        for (int batch = 0; batch < batches; ++batch) {  // postures far apart at once: contact is found early
            for (int lane = 0; lane < LANES; ++lane) {
                const double share = (double)std::min(count, batch + 1 + lane * batches) / count;
                for (int j = 0; j < k; ++j) theta_[j][lane] = from[j] + share * (to[j] - from[j]);
            }
            eight.place(theta_.data());
            if (schedule) eight.times = schedule->passing(theta_);
            if (any_below(given, which)) return false;
        }
        return true;
    }

    Eight eight;
    const Schedule* schedule = nullptr;  // where solids move

private:
    bool any_below(double given, unsigned which) {
        stack_.clear();
        roots(world_, which, [this](const Item& item) { stack_.push_back(item); });
        while (!stack_.empty()) {
            const Item item = stack_.back();
            stack_.pop_back();
            if (!bits(~(room(eight, item, all(given)) >= given))) continue;  // what is no number is not clear
            if (opening(world_, item) == 0.0) return true;
            open(world_, item, [this](const Item& part) { stack_.push_back(part); });
        }
        return false;
    }

    const World& world_;
    std::vector<Item> stack_;
    std::vector<Lanes> theta_;
};

// Of each link and each solid, and of each two links, the two balls that come nearest; and what comes nearest of all.
class Nearest {
public:
    explicit Nearest(const World& world) : eight(world), world_(world), gradient_(world.dof) {}

    // Tell what is nearest of all in the eight postures that are placed, where there is anything; the first so many count.
    // Points are those of both surfaces that are nearest, three numbers each.
    template <class Tell>
    void of_all(unsigned which, int lanes, Tell tell) {
        found_.fill(all(HUGE_VAL));
        roots(world_, which, [this](const Item& item) { look(item); });
        for (int lane = 0; lane < lanes; ++lane) {
            if (!(found_.values[0][lane] < HUGE_VAL)) continue;
            const Item& item = found_.items[0][lane];
            double points[6];
            surfaces(item, lane, points);
            tell(lane, item, found_.values[0][lane], points);
        }
    }

    // Tell what of the eight postures that are placed has less room than is given; the first so many count.
    template <class Tell>
    void below(double given, unsigned which, int lanes, Tell tell) {
        tops_.clear();
        roots(world_, which, [this](const Item& item) { tops_.push_back(item); });
        for (const Item& top : tops_) {
            found_.fill(all(given));
            look(top);
            for (int lane = 0; lane < lanes; ++lane)
                for (int rank = 0; rank < 2; ++rank)
                    if (found_.values[rank][lane] < given) {
                        slopes(found_.items[rank][lane], lane);
                        tell(lane, kind(top), found_.values[rank][lane], rate_, gradient_.data());
                    }
        }
    }

    Eight eight;

private:
    struct Ranking {
        Lanes values[2];
        Item items[2][LANES];
        void fill(Lanes value) { values[0] = values[1] = value; }
    };

    void look(const Item& top) {
        stack_.assign(1, top);
        while (!stack_.empty()) {
            const Item item = stack_.back();
            stack_.pop_back();
            const Lanes here = room(eight, item, found_.values[1]);
            const unsigned nearer = bits(here < found_.values[1]);
            if (!nearer) continue;
            if (opening(world_, item) > 0.0) {
                open(world_, item, [this](const Item& part) { stack_.push_back(part); });
                continue;
            }
            for (int lane = 0; lane < LANES; ++lane)
                if (nearer >> lane & 1u) rank(item, here[lane], lane);
        }
    }

    void rank(const Item& item, double value, int lane) {
        const int place = value < found_.values[0][lane] ? 0 : 1;
        if (place == 0) {
            found_.values[1][lane] = found_.values[0][lane];
            found_.items[1][lane] = found_.items[0][lane];
        }
        found_.values[place][lane] = value;
        found_.items[place][lane] = item;
    }

    // The points of a ball, and of the solid or ball that it is near, that are nearest to each other.
    void surfaces(const Item& item, int lane, double* points) {
        slopes(item, lane);
        const Point& centers = eight.center(item.one);
        const double p[3] = {centers.x[lane], centers.y[lane], centers.z[lane]};
        double apart = 0.0;
        if (item.group < 0) {
            apart = from_solid(item, lane) - world_.nodes[item.one].radius;
        } else {
            const Point way = centers - eight.center(item.two);
            apart = length(way)[lane] - world_.nodes[item.one].radius - world_.nodes[item.two].radius;
        }
        for (int i = 0; i < 3; ++i) {
            points[i] = p[i] - world_.nodes[item.one].radius * out_[i];
            points[3 + i] = points[i] - apart * out_[i];
        }
    }

    // How far a ball's centre is from a solid, where that is.
    double from_solid(const Item& item, int lane) {
        const Solid& solid = world_.solids[item.two];
        if (solid.shape == ASKED) return asked_distances(world_, item.two, eight.center(item.one), eight.times)[lane];
        const Point there = eight.drifts ? as_seen_from(eight.drifts[item.two], eight, item.one) : eight.center(item.one);
        return distance(solid, there, all(HUGE_VAL))[lane];
    }

    // Along the way out of what is nearest each joint moves the centre of the ball, and time moves the solid.
    void slopes(const Item& item, int lane) {
        const Point& centers = eight.center(item.one);
        const double p[3] = {centers.x[lane], centers.y[lane], centers.z[lane]};
        double* out = out_;
        rate_ = 0.0;
        if (item.group < 0 && world_.solids[item.two].shape == ASKED) {
            asked_way_out(item.two, p, eight.times[lane], out);
        } else if (item.group < 0 && eight.drifts) {
            const Drift& drift = eight.drifts[item.two];
            const Point from = as_seen_from(drift, eight, item.one);
            const double seen[3] = {from.x[lane], from.y[lane], from.z[lane]};
            way_out(world_.solids[item.two], seen, out);
            for (int i = 0; i < 3; ++i) rate_ -= drift.velocity[i] * out[i];
            rate_ -= drift.rate;
        } else if (item.group < 0) {
            way_out(world_.solids[item.two], p, out);
        } else {
            const Point apart = eight.center(item.one) - eight.center(item.two);
            const double d[3] = {apart.x[lane], apart.y[lane], apart.z[lane]};
            const double norm = std::max(std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), 1e-12);
            for (int i = 0; i < 3; ++i) out[i] = d[i] / norm;
        }
        std::fill(gradient_.begin(), gradient_.end(), 0.0);
        const int common = item.group < 0 ? 0 : world_.groups[item.group].common;
        moves(item.one, common, 1.0, lane);
        if (item.group >= 0) moves(item.two, common, -1.0, lane);
    }

    // How each joint between a body and that of a node moves the centre of the node out of what is nearest, or into it.
    void moves(int node, int from, double sign, int lane) {
        const Point& centers = eight.center(node);
        const double p[3] = {centers.x[lane], centers.y[lane], centers.z[lane]};
        const double out[3] = {sign * out_[0], sign * out_[1], sign * out_[2]};
        for (int joint = world_.nodes[node].body; joint != from; joint = world_.joints[joint - 1].parent) {
            const Frame& frame = eight.frames[joint];
            const double* axis = world_.joints[joint - 1].axis;
            double a[3];
            for (int i = 0; i < 3; ++i)
                a[i] = frame.rotation[3 * i][lane] * axis[0] + frame.rotation[3 * i + 1][lane] * axis[1] +
                       frame.rotation[3 * i + 2][lane] * axis[2];
            if (!world_.joints[joint - 1].turns) {
                gradient_[joint - 1] = a[0] * out[0] + a[1] * out[1] + a[2] * out[2];
                continue;
            }
            const double d[3] = {p[0] - frame.origin.x[lane], p[1] - frame.origin.y[lane], p[2] - frame.origin.z[lane]};
            gradient_[joint - 1] = (a[1] * d[2] - a[2] * d[1]) * out[0] + (a[2] * d[0] - a[0] * d[2]) * out[1] +
                                   (a[0] * d[1] - a[1] * d[0]) * out[2];
        }
    }

    // The unit vector along which the distance grows fastest, by differences: six points at once.
    static void way_out(const Solid& solid, const double* p, double* out) {
        along(distance(solid, around(p), all(HUGE_VAL)), out);
    }

    // The same of a solid that the core does not know; the last two points tell how its distance changes with the time.
    void asked_way_out(int solid, const double* p, double time, double* out) {
        Lanes times = all(time);
        times[6] += STEP, times[7] -= STEP;
        const Lanes there = asked_distances(world_, solid, around(p), times);
        along(there, out);
        rate_ = (there[6] - there[7]) / (2.0 * STEP);
    }

    static Point around(const double* p) {
        Point around = {all(p[0]), all(p[1]), all(p[2])};
        around.x[0] += STEP, around.x[1] -= STEP, around.y[2] += STEP;
        around.y[3] -= STEP, around.z[4] += STEP, around.z[5] -= STEP;
        return around;
    }

    static void along(const Lanes& there, double* out) {
        double square = 0.0;
        for (int i = 0; i < 3; ++i) {
            out[i] = there[2 * i] - there[2 * i + 1];
            square += out[i] * out[i];
        }
        const double norm = std::max(std::sqrt(square), 1e-12);
        for (int i = 0; i < 3; ++i) out[i] /= norm;
    }

    static constexpr double STEP = 1e-6;  // m, s
    const World& world_;
    Ranking found_;
    std::vector<Item> tops_, stack_;
    std::vector<double> gradient_;  // of the room by the joints
    double rate_ = 0.0;             // and by the time
    double out_[3] = {};            // the way out of what is nearest
};

}  // namespace core
