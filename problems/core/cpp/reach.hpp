// Damped Newton steps that lead eight postures at once to a pose of the tool: Levenberg's, J^T (J J^T + lambda I)^-1 e
// with lambda = 0.05 |e|^2, no longer than 0.6 rad in any joint, and within the joints' bounds.
#pragma once
#include "world.hpp"

namespace core {

struct Target {
    double position[3], rotation[9];
};

class Reach {
public:
    static constexpr double CONVERGED = 1e-12, LEAST_GAIN = 0.2;
    static constexpr int PATIENCE = 10;  // steps in which less has to be missing

    // Of an arm whose tool is at a place in the frame of a body, (rotation, translation); its targets are turned or not.
    Reach(const World& arm, int carrier, const double* tool, bool turned, const double* lower, const double* upper)
        : eight_(arm), carrier_(carrier), lower_(lower), upper_(upper), size_(turned ? 6 : 3), tool_(tool), columns_(arm.dof),
          moved_(arm.dof) {}

    // What the tool of a lane is to reach.
    void aim(int lane, const Target& target) {
        for (int i = 0; i < 3; ++i) {
            position_[i][lane] = target.position[i];
            for (int j = 0; j < 3; ++j) {  // the rotation that the body's frame needs: target tool^T
                double sum = 0.0;
                for (int k = 0; k < 3; ++k) sum += target.rotation[3 * i + k] * tool_[3 * j + k];
                wanted_[3 * i + j][lane] = sum;
            }
        }
    }

    // At most so many steps from postures; what is missing then, m and rad together, in each lane.
    Lanes operator()(Lanes* theta, int steps) {
        Lanes before = all(INFINITY), missing = look(theta);
        Mask going = missing > CONVERGED;
        for (int number = 0; number < steps; ++number) {
            if (number % PATIENCE == 0) {
                going &= missing < (1.0 - LEAST_GAIN) * before;
                before = missing;
            }
            going &= missing > CONVERGED;
            if (bits(going) == 0) break;
            step(theta, missing, going);
            missing = look(theta);
        }
        return missing;
    }

    // Whether the tool is at its place, and turned as it is to be, within a tolerance, m and rad.
    Mask arrived(const Lanes* theta, double tolerance) {
        const Lanes size = look(theta);
        Mask found = size < 1.0;  // half a turn has no axis
        for (int first = 0; first < size_; first += 3) {
            Lanes sum = {};
            for (int i = first; i < first + 3; ++i) sum += missing_[i] * missing_[i];
            found &= root(sum) <= tolerance;
        }
        return found;
    }

    // What the tool lacks, in all: metres, then the Rodrigues vector 2 tan(a / 2) of the turn.
    Lanes look(const Lanes* theta) {
        eight_.place(theta);
        const Frame& last = eight_.frames[carrier_];
        place_ = placed(last, tool_ + 9);
        const Lanes at[3] = {place_.x, place_.y, place_.z};
        for (int i = 0; i < 3; ++i) missing_[i] = position_[i] - at[i];
        Mask over = {};
        if (size_ > 3) {
            Lanes turn[9];
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    turn[3 * i + j] = wanted_[3 * i] * last.rotation[3 * j] +
                                      wanted_[3 * i + 1] * last.rotation[3 * j + 1] +
                                      wanted_[3 * i + 2] * last.rotation[3 * j + 2];
            const Lanes beside = 0.5 * (turn[0] + turn[4] + turn[8] + 1.0);  // 1 + cos(a)
            const Lanes factor = 1.0 / most(all(UPSIDE_DOWN), beside);
            over = beside < UPSIDE_DOWN;
            missing_[3] = (turn[7] - turn[5]) * factor;
            missing_[4] = (turn[2] - turn[6]) * factor;
            missing_[5] = (turn[3] - turn[1]) * factor;
        }
        Lanes sum = missing_[0] * missing_[0];
        for (int i = 1; i < size_; ++i) sum += missing_[i] * missing_[i];
        return chosen(over, most(root(sum), all(1.0)), root(sum));  // half a turn has no axis
    }

    // Yoshikawa's measure of the postures of the last look, the root of det(J J^T).
    Lanes manipulability() {
        columns();
        factored(Lanes{});
        Lanes product = pivot_[0];
        for (int i = 1; i < size_; ++i) product *= pivot_[i];
        return chosen(product > 0.0, root(product), Lanes{});  // where a pivot is none there is no number
    }

    // A step of the lanes that go on, after a look.
    void step(Lanes* theta, Lanes missing, Mask going) {
        const int k = eight_.world.dof;
        const Lanes damping = DAMPING * (missing * missing) + LEAST_DAMPING;
        columns();
        solved(damping);
        Mask stuck = {};
        for (int joint = 0; joint < k; ++joint) {
            const Mask leaves = ((theta[joint] >= upper_[joint]) & (moved_[joint] > 0.0)) |
                                ((theta[joint] <= lower_[joint]) & (moved_[joint] < 0.0));
            stuck |= leaves;
            for (int i = 0; i < size_; ++i) columns_[joint].part[i] = chosen(leaves, Lanes{}, columns_[joint].part[i]);
        }
        if (bits(stuck)) solved(damping);  // the others do its part
        Lanes longest = all(LONGEST_STEP);
        for (int joint = 0; joint < k; ++joint) longest = most(longest, size(moved_[joint]));
        for (int joint = 0; joint < k; ++joint) {
            const Lanes to = theta[joint] + moved_[joint] * (LONGEST_STEP / longest);
            theta[joint] = chosen(going, least(all(upper_[joint]), most(all(lower_[joint]), to)), theta[joint]);
        }
    }

private:
    static constexpr double DAMPING = 0.05, LEAST_DAMPING = 1e-12, LONGEST_STEP = 0.6, UPSIDE_DOWN = 1e-3;

    // How each joint moves the tool.
    void columns() {
        for (int joint = carrier_; joint > 0; joint = eight_.world.joints[joint - 1].parent) {
            const Point axis = eight_.axis(joint);
            const bool turns = eight_.world.joints[joint - 1].turns;
            const Point way = turns ? cross(axis, place_ - eight_.frames[joint].origin) : axis;
            const Point spin = turns ? axis : Point{Lanes{}, Lanes{}, Lanes{}};
            columns_[joint - 1] = {{way.x, way.y, way.z, spin.x, spin.y, spin.z}};
        }
    }

    // The small symmetric matrix J J^T + damping as L D L^T.
    void factored(Lanes damping) {
        for (int i = 0; i < size_; ++i) {
            for (int j = 0; j <= i; ++j) {
                Lanes sum = i == j ? damping : Lanes{};
                for (const Column& column : columns_) sum += column.part[i] * column.part[j];
                for (int m = 0; m < j; ++m) sum -= factor_[i][m] * factor_[j][m] * pivot_[m];
                if (i == j)
                    pivot_[i] = sum;
                else
                    factor_[i][j] = sum / pivot_[j];
            }
        }
    }

    // The step.
    void solved(Lanes damping) {
        factored(damping);
        Lanes weight[6];
        for (int i = 0; i < size_; ++i) {
            weight[i] = missing_[i];
            for (int m = 0; m < i; ++m) weight[i] -= factor_[i][m] * weight[m];
        }
        for (int i = size_ - 1; i >= 0; --i) {
            weight[i] /= pivot_[i];
            for (int m = i + 1; m < size_; ++m) weight[i] -= factor_[m][i] * weight[m];
        }
        for (size_t joint = 0; joint < columns_.size(); ++joint) {
            moved_[joint] = columns_[joint].part[0] * weight[0];
            for (int i = 1; i < size_; ++i) moved_[joint] += columns_[joint].part[i] * weight[i];
        }
    }

    struct Column {
        Lanes part[6];
    };

    Eight eight_;
    const int carrier_;  // of the tool; joints of other branches do not move it, and their columns stay zero
    const double *lower_, *upper_;
    const int size_;
    const double* tool_;
    Lanes position_[3] = {}, wanted_[9] = {};
    Point place_;
    Lanes missing_[6], factor_[6][6], pivot_[6];
    std::vector<Column> columns_;
    std::vector<Lanes> moved_;
};

}  // namespace core
