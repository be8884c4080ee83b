// A question about every time of a motion, by cells: shares of what is allowed, bounded in cells and seen at moments.
//
// A cell is settled where its bound is no larger than an aim: what is allowed, or a little more than the largest share
// that was seen. Others are halved. A bound is an upper one with rounding, so that what is settled is proven.
#pragma once
#include "motion.hpp"

namespace core {

// Args: the largest share that is allowed; by which share of the largest seen the proven one may be larger, infinite
// where that does not matter; a share below which it does not; cells at least, and at most.
struct Aim {
    double allowed, gap, least;
    int first_cells;
    long long most_cells;
};

constexpr int ZOOMS = 3, ZOOM_POINTS = 65;
constexpr int FINEST = 40;  // level of cells, all of which are of one level at a time; finer ones drown in rounding

struct Found {
    int status;        // 1: proven; 0: broken at a moment; -1: not known
    double share;      // the largest that was seen
    Moment moment;     // of that
    double start, end;  // of a cell in which it is not known, s
    std::vector<Moment> broken;
};

// The largest of shares; infinite where one of them is no number.
struct Largest {
    Lanes share = -unbounded();
    Mask known = ~Mask{};
    Mask add(Lanes own) {
        const Mask larger = own > share;
        known &= own < HUGE_VAL;
        share = chosen(larger, own, share);
        return larger;
    }
    Lanes value() const { return chosen(known, share, unbounded()); }
};

template <class Question>
class Bisection {
public:
    Bisection(Polynomials& polynomials, Question& question, const Aim& aim)
        : polynomials(polynomials), question(question), aim(aim) {
        found.share = -HUGE_VAL, found.moment = {0, 0.0}, found.start = found.end = 0.0;
    }

    // After moments that are looked at first. At the end the largest share that was seen is followed to its peak, from
    // so many s before and behind.
    Found operator()(const std::vector<Moment>& moments, double step) {
        look(moments);
        std::vector<Cell> cells = first_cells();
        long long count = 0, most = aim.most_cells + (long long)cells.size();
        while (!cells.empty() && cells.front().level <= FINEST && count + (long long)cells.size() <= most) {
            count += (long long)cells.size();
            cells = left_of(cells);
        }
        for (int zoom = 0; zoom < ZOOMS; ++zoom, step *= 2.0 / (ZOOM_POINTS - 1)) follow(step);
        found.status = found.share <= aim.allowed ? (cells.empty() ? 1 : -1) : 0;
        if (!cells.empty()) {
            const Cell& first = cells.front();
            const double begin = polynomials.start(first.piece);
            found.start = begin + polynomials.moment(first, -1.0).offset;
            found.end = begin + polynomials.moment(first, 1.0).offset;
        }
        return found;
    }

private:
    std::vector<Cell> first_cells() const {
        int level = 0;
        while ((long long)polynomials.motion.pieces << level < aim.first_cells) ++level;
        std::vector<Cell> cells;
        for (int piece = 0; piece < polynomials.motion.pieces; ++piece)
            for (long long number = 0; number < 1LL << level; ++number) cells.push_back({piece, level, (double)number});
        return cells;
    }

    // Halves of the cells that are not settled.
    std::vector<Cell> left_of(const std::vector<Cell>& cells) {
        std::vector<double> bounds;
        std::vector<Moment> moments;
        for (size_t from = 0; from < cells.size(); from += LANES) {
            Cell eight[LANES];
            for (size_t lane = 0; lane < LANES; ++lane) eight[lane] = cells[std::min(from + lane, cells.size() - 1)];
            polynomials.over(eight, models);
            Lanes where = {};
            const Lanes share = question.bound(models, where);
            for (size_t lane = 0; lane < LANES && from + lane < cells.size(); ++lane) {
                bounds.push_back(share[lane]);
                moments.push_back(polynomials.moment(eight[lane], where[lane]));
            }
        }
        look(moments);
        double target = std::max(found.share, aim.least) * (1.0 + aim.gap);
        if (found.share <= aim.allowed && aim.allowed < target) target = aim.allowed;
        std::vector<Cell> left;
        for (size_t i = 0; i < cells.size(); ++i)
            if (!(bounds[i] <= target))
                for (double half : {0.0, 1.0}) left.push_back({cells[i].piece, cells[i].level + 1, 2.0 * cells[i].number + half});
        return left;
    }

    // Look around the largest share.
    void follow(double step) {
        const double* breaks = polynomials.motion.breaks;
        const int last = polynomials.motion.pieces - 1;
        const double middle = breaks[found.moment.piece] + found.moment.offset;
        std::vector<Moment> around;
        for (int i = 0; i < ZOOM_POINTS; ++i) {
            const double time = middle + step * (2.0 * i / (ZOOM_POINTS - 1) - 1.0);
            const double inside = std::min(std::max(time, breaks[0]), breaks[last + 1]);
            const int piece = std::min((int)(std::upper_bound(breaks, breaks + last + 1, inside) - breaks) - 1, last);
            around.push_back({piece, inside - breaks[piece]});
        }
        look(around);
    }

    void look(const std::vector<Moment>& moments) {
        for (size_t from = 0; from < moments.size(); from += LANES) {
            Moment eight[LANES];
            for (size_t lane = 0; lane < LANES; ++lane) eight[lane] = moments[std::min(from + lane, moments.size() - 1)];
            polynomials.at(eight, numbers);
            const Lanes seen = question.seen(numbers);
            for (size_t lane = 0; lane < LANES && from + lane < moments.size(); ++lane) {
                if (seen[lane] > found.share) found.share = seen[lane], found.moment = eight[lane];
                if (seen[lane] > aim.allowed) found.broken.push_back(eight[lane]);
            }
        }
    }

    Polynomials& polynomials;
    Question& question;
    const Aim aim;
    Found found;
    State<Model> models;
    State<Lanes> numbers;
};

}  // namespace core
