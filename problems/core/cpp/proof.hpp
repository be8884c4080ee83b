// Room proven for all t of a motion whose joints are polynomials of time.
//
// In a cell of time of half length h about its middle m, joint j is never farther from where it is at m than
//     turn_j = |q'_j(m)| h + |q''_j(m)| h^2 / 2 + |q'''_j(m)| h^3 / 6 + ...
// Let the joints move one after the other, the first one first: each moves all that comes after it as one rigid body,
// so that the distance of a point from an axis is still that at m when it is the axis's turn. So the point travels by
// no more than
//     sum over the joints that move it of turn_j (its distance from axis j at m).
// A distance changes by no more than the point moves; of two bodies only the joints between them count: those from the
// last body on whose branch both are to each of them. A solid that
// moves at a constant velocity adds its speed times h, and what is kept from it grows by its rate times h; of a solid that the core does not know
// those who know it say how much the distance changes by itself. Where joints
// are off what is planned by no more than e_j, the least of all distances is less by no more than the sum of e_j times the
// same levers: joint j is then within turn_j + e_j of its place at m, whatever the others do. What has more
// room at m than all that has room all through the cell. What has not is opened, if it is larger than it
// travels; else the cell is cut in halves, and only what is left of it is looked at there.
#pragma once
#include <algorithm>
#include <vector>

#include "motion.hpp"
#include "world.hpp"

namespace core {

struct Proof {
    int status;        // 1: proven; 0: too near at some time; -1: not known
    double proven;     // room, m, at all times
    double smallest;   // room that was seen, m
    double time;       // of that, s
    Item where;        // of that
    long long looked;  // items
    double start, end;  // of a cell in which it is not known, s
};

class Prover {
public:
    // Args: how solids move, or null; how much farther than by the world's own rounding a distance may be off then, m;
    // how far joints may be off, (3, k), or null: a constant, shares of speed and acceleration.
    Prover(const World& world, const Motion& motion, const Drift* drifts, double rounding, const double* tracking)
        : eight_(world), world_(world), motion_(motion), rounding_(world.rounding + rounding), tracking_(tracking),
          theta_(world.dof), turns_(world.dof), axes_(world.dof + 1), travels_(world.solids.size()),
          known_travels_(world.solids.size(), 0u) {
        eight_.drifts = drifts;
        if (tracking) eight_.errors.resize(world.dof);
        for (size_t k = 0; drifts && k < world.solids.size(); ++k) {
            const double* v = drifts[k].velocity;
            paces_.push_back(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + drifts[k].rate);
        }
    }

    // Args: what has to keep a distance; by which share of the smallest room seen the proven one may be smaller; cells
    // at least; items that are looked at, at most.
    Proof operator()(unsigned which, double gap, int cells, long long most) {
        found_ = {-1, -HUGE_VAL, HUGE_VAL, 0.0, {-1, -1, -1}, 0, 0.0, 0.0};
        const double total = motion_.breaks[motion_.pieces] - motion_.breaks[0];
        Batch batch{};
        int lanes = 0;
        const auto begun = [&](unsigned used) {
            roots(world_, which, [&](const Item& item) { batch.items.push_back({item, used}); });
            seen(batch);
            waiting_.push_back(std::move(batch));
            batch = Batch{};
            lanes = 0;
        };
        for (int piece = 0; piece < motion_.pieces; ++piece) {
            const double length = motion_.breaks[piece + 1] - motion_.breaks[piece];
            const int parts = std::max(1, (int)std::ceil(cells * length / total));
            for (int part = 0; part < parts; ++part) {
                const double end = part + 1 < parts ? length * (part + 1) / parts : length;
                batch.cells[lanes++] = {piece, length * part / parts, end};
                if (lanes == LANES) begun(EVERY_LANE);
            }
        }
        if (lanes) {
            for (int lane = lanes; lane < LANES; ++lane) batch.cells[lane] = batch.cells[lanes - 1];
            begun((1u << lanes) - 1u);
        }
        std::reverse(waiting_.begin(), waiting_.end());
        return settled(gap, most);
    }

private:
    struct Cell {
        int piece;
        double start, end;  // s, since the piece began
    };
    struct Open {
        Item item;
        unsigned lanes;  // cells in which it is not settled
    };
    struct Batch {
        Cell cells[LANES];
        std::vector<Open> items;
    };

    Proof settled(double gap, long long most) {
        while (!waiting_.empty()) {
            const Batch batch = std::move(waiting_.back());
            waiting_.pop_back();
            place(batch);
            left_.clear();
            for (const Open& open : batch.items) look(open, gap, batch);
            if (found_.smallest < 0.0) {
                found_.status = 0;
                return found_;
            }
            if (!left_.empty() && (found_.looked > most || !halved(batch, 0) || !halved(batch, LANES / 2)))
                return unknown(batch, left_.front());
            if (found_.looked > most && !waiting_.empty())
                return unknown(waiting_.back(), waiting_.back().items.front());
        }
        found_.status = 1;
        found_.proven = found_.smallest < HUGE_VAL ? target(gap) : HUGE_VAL;
        return found_;
    }

    Proof unknown(const Batch& batch, const Open& open) {
        int lane = 0;
        while (!(open.lanes >> lane & 1u)) ++lane;
        const Cell& cell = batch.cells[lane];
        found_.start = motion_.breaks[cell.piece] + cell.start;
        found_.end = motion_.breaks[cell.piece] + cell.end;
        return found_;
    }

    double target(double gap) const { return found_.smallest * (1.0 - gap); }

    // Four of the cells in halves, with what is left in them; false where they are too short to be halved.
    bool halved(const Batch& batch, int from) {
        Batch next{};
        for (int lane = 0; lane < LANES; ++lane) {
            Cell cell = batch.cells[from + lane / 2];
            const double middle = cell.start + (cell.end - cell.start) / 2.0;
            if (!(cell.start < middle && middle < cell.end)) return false;
            (lane % 2 ? cell.start : cell.end) = middle;
            next.cells[lane] = cell;
        }
        for (const Open& open : left_) {
            unsigned lanes = 0;
            for (int lane = 0; lane < LANES; ++lane) lanes |= (open.lanes >> (from + lane / 2) & 1u) << lane;
            if (lanes) next.items.push_back({open.item, lanes});
        }
        if (!next.items.empty()) waiting_.push_back(std::move(next));
        return true;
    }

    // Postures in the middles of cells, and how far each joint turns from there.
    void place(const Batch& batch) {
        const int k = world_.dof, order = motion_.order;
        powers_.resize(order);
        ++batch_;
        for (int lane = 0; lane < LANES; ++lane) {
            const Cell& cell = batch.cells[lane];
            const double middle = cell.start + (cell.end - cell.start) / 2.0;
            const double half = std::max(cell.end - middle, middle - cell.start) * (1.0 + 1e-12);
            eight_.times[lane] = motion_.breaks[cell.piece] + middle;
            halves_[lane] = half;
            cells_[lane] = eight_.times[lane] - half, cells_[LANES + lane] = eight_.times[lane] + half;
            for (int j = 0; j < k; ++j) {
                for (int d = 0; d < order; ++d) powers_[d] = coefficient(order - 1 - d, cell.piece, j);
                double sum = 0.0;  // of the sizes of all terms: what rounding is relative to
                for (int d = order - 1; d >= 0; --d) sum = sum * (middle + half) + std::fabs(powers_[d]);
                for (int d = 0; d < order; ++d)  // Horner's scheme again and again: the expansion around the middle
                    for (int i = order - 2; i >= d; --i) powers_[i] += middle * powers_[i + 1];
                double turn = 0.0;
                for (int d = order - 1; d >= 1; --d) turn = (turn + std::fabs(powers_[d])) * half;
                theta_[j][lane] = powers_[0];
                turns_[j][lane] = turn * (1.0 + 1e-12) + 1e-14 * sum;
                if (tracking_) off(j, lane, half, middle + half, cell.piece);
            }
        }
        eight_.place(theta_.data());
        for (int j = 1; j <= k; ++j) axes_[j] = eight_.axis(j);
    }

    // By how much a joint may be off in the middle of a cell, and by how much more anywhere in it: its expansion around
    // the middle is in powers_.
    void off(int joint, int lane, double half, double end, int piece) {
        const int k = world_.dof, order = motion_.order;
        const double by_speed = tracking_[k + joint], by_acceleration = tracking_[2 * k + joint];
        const double speed = order > 1 ? std::fabs(powers_[1]) : 0.0;
        const double acceleration = order > 2 ? 2.0 * std::fabs(powers_[2]) : 0.0;
        double faster = 0.0, sharper = 0.0, power = 1.0;  // than in the middle, at most; powers of half a cell
        double speeds = 0.0, accelerations = 0.0;         // the sizes of all terms: what rounding is relative to
        for (int d = order - 1; d >= 1; --d) {
            const double term = d * std::fabs(coefficient(order - 1 - d, piece, joint));
            speeds = speeds * end + term;
            if (d > 1) accelerations = accelerations * end + (d - 1) * term;
        }
        for (int d = 2; d < order; ++d) {
            if (d > 2) sharper += d * (d - 1) * std::fabs(powers_[d]) * power;
            power *= half;
            faster += d * std::fabs(powers_[d]) * power;
        }
        faster += 1e-14 * speeds;
        sharper += 1e-14 * accelerations;
        const double here = tracking_[joint] + by_speed * speed + by_acceleration * acceleration;
        eight_.errors[joint][lane] = here * (1.0 + 1e-12);
        turns_[joint][lane] += (by_speed * faster + by_acceleration * sharper) * (1.0 + 1e-12);
    }

    double coefficient(int row, int piece, int joint) const {
        return motion_.coefficients[((size_t)row * motion_.pieces + piece) * world_.dof + joint];
    }

    // By how much the room of an item can shrink at most.
    Lanes shrinking(const Item& item) {
        if (item.group >= 0) {
            const int common = world_.groups[item.group].common;
            const Lanes moved = travel(item.one, common);
            return world_.nodes[item.two].body == common ? moved : moved + travel(item.two, common);
        }
        const Lanes moved = travel(item.one, 0);
        if (world_.solids[item.two].shape == ASKED) return moved + asked_travel(item.two);
        return paces_.empty() ? moved : moved + paces_[item.two] * halves_ * (1.0 + 1e-12);
    }

    // By how much the distances of a solid that the core does not know change by themselves; asked once in a batch.
    const Lanes& asked_travel(int solid) {
        if (known_travels_[solid] != batch_) {
            double found[LANES];
            world_.asked.travel(solid, cells_, found);
            for (int lane = 0; lane < LANES; ++lane) travels_[solid][lane] = found[lane];
            known_travels_[solid] = batch_;
        }
        return travels_[solid];
    }

    // How far the centre of a node moves at most as seen from a body on whose branch it is.
    Lanes travel(int number, int from) {
        const Point& center = eight_.center(number);
        Lanes moved = {};
        for (int joint = world_.nodes[number].body; joint != from; joint = world_.joints[joint - 1].parent) {
            const Lanes turn = turns_[joint - 1];
            if (!world_.joints[joint - 1].turns) {
                moved += turn;
                continue;
            }
            const Lanes lever = length(cross(axes_[joint], center - eight_.frames[joint].origin));
            moved += turn * lever;
        }
        return moved * (1.0 + 1e-12) + rounding_;
    }

    // The smallest room in the middles, so that it is known from the beginning what can be proven.
    void seen(const Batch& batch) {
        place(batch);
        stack_ = batch.items;
        while (!stack_.empty()) {
            const Open open = stack_.back();
            stack_.pop_back();
            const Lanes here = room(eight_, open.item, all(found_.smallest + rounding_));
            if (!bits(here - rounding_ < found_.smallest)) continue;
            if (opening(world_, open.item) == 0.0) noted(open, here, batch);
            else core::open(world_, open.item, [&](const Item& part) { stack_.push_back({part, open.lanes}); });
        }
    }

    void look(const Open& first, double gap, const Batch& batch) {
        stack_.assign(1, first);
        while (!stack_.empty()) {
            const Open open = stack_.back();
            stack_.pop_back();
            ++found_.looked;
            const Lanes here = room(eight_, open.item, all(HUGE_VAL));
            const double size = opening(world_, open.item);
            if (size == 0.0) noted(open, here, batch);
            const Lanes moved = shrinking(open.item);
            const unsigned unsettled = bits(~(here - moved >= target(gap))) & open.lanes;
            if (!unsettled) continue;
            const unsigned large = bits(size > moved) & unsettled, small = unsettled & ~large;
            if (small) left_.push_back({open.item, small});
            if (large)
                core::open(world_, open.item, [&](const Item& part) { stack_.push_back({part, large}); });
        }
    }

    void noted(const Open& open, Lanes here, const Batch& batch) {
        for (int lane = 0; lane < LANES; ++lane) {
            const double kept = here[lane] - rounding_;
            if (!(open.lanes >> lane & 1u) || !(kept < found_.smallest)) continue;
            const Cell& cell = batch.cells[lane];
            found_.smallest = kept;
            found_.time = motion_.breaks[cell.piece] + cell.start + (cell.end - cell.start) / 2.0;
            found_.where = open.item;
        }
    }

    Eight eight_;
    const World& world_;
    const Motion motion_;
    const double rounding_;      // m
    const double* tracking_;
    std::vector<double> paces_;  // at which solids come nearer at most, m/s; none where they stand still
    Lanes halves_ = {};          // of the cells, s
    Proof found_;
    std::vector<Batch> waiting_;
    std::vector<Open> stack_, left_;
    std::vector<Lanes> theta_, turns_;
    std::vector<Point> axes_;
    std::vector<double> powers_;
    double cells_[2 * LANES] = {};  // of the batch: starts, ends, s
    std::vector<Lanes> travels_;
    std::vector<unsigned> known_travels_;  // the batch for which each was asked
    unsigned batch_ = 0;
};

}  // namespace core
