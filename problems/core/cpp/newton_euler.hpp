// Newton and Euler: torques of a tree of rigid bodies in eight states at once, and how they change with the states.
// The recursion is that of problems/robots/dynamics.py: of numbers, of numbers with a slope, of Taylor models.
#pragma once
#include <vector>

#include "models.hpp"
#include "world.hpp"

namespace core {

// Numbers that change with one angle, velocity or acceleration.
struct Sloped {
    Lanes value, slope;
};

INLINE Sloped operator+(const Sloped& a, const Sloped& b) { return {a.value + b.value, a.slope + b.slope}; }
INLINE Sloped operator-(const Sloped& a, const Sloped& b) { return {a.value - b.value, a.slope - b.slope}; }
INLINE Sloped operator*(double a, const Sloped& b) { return {a * b.value, a * b.slope}; }
INLINE Sloped operator*(const Sloped& a, const Sloped& b) {
    return {a.value * b.value, a.slope * b.value + a.value * b.slope};
}
INLINE Sloped operator+(double a, const Sloped& b) { return {a + b.value, b.slope}; }

INLINE void sine_cosine(const Sloped& angle, Sloped& sine, Sloped& cosine) {
    sine_cosine(angle.value, sine.value, cosine.value);
    sine.slope = cosine.value * angle.slope;
    cosine.slope = -(sine.value * angle.slope);
}

template <class T>
struct Triple {
    T x, y, z;
};

template <class T>
INLINE Triple<T> operator+(const Triple<T>& a, const Triple<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T, class S>
INLINE Triple<T> cross(const Triple<T>& a, const Triple<S>& b) {
    return {b.z * a.y - b.y * a.z, b.x * a.z - b.z * a.x, b.y * a.x - b.x * a.y};
}
template <class T>
INLINE Triple<T> scaled(const double* a, const T& b) {
    return {a[0] * b, a[1] * b, a[2] * b};
}
INLINE Triple<double> plain(const double* a) { return {a[0], a[1], a[2]}; }

// A body with the joint that moves it; moments are about the origin of the joint's frame.
struct Body {
    Joint joint;
    double mass, first[3], second[9];  // kg, kg m, kg m^2
};

// Bodies in the order of their joints; none comes before the one that it is on.
struct Chain {
    std::vector<Body> bodies;
    double gravity[3];  // m/s^2
};

// Where the frame of a joint is in that of the body that it is on.
template <class T>
struct Pose {
    T rotation[9];
    Triple<T> translation;

    Triple<T> turned(const Triple<T>& v) const {
        const T* r = rotation;
        return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
                r[6] * v.x + r[7] * v.y + r[8] * v.z};
    }
    Triple<T> turned_back(const Triple<T>& v) const {
        const T* r = rotation;
        return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
                r[2] * v.x + r[5] * v.y + r[8] * v.z};
    }
};

template <class T>
INLINE Pose<T> pose_of(const Joint& joint, const T& value) {
    Pose<T> pose;
    const T none = 0.0 * value;
    const double* p = joint.translation;
    if (joint.turns) {
        T sine, cosine;
        sine_cosine(value, sine, cosine);
        for (int i = 0; i < 9; ++i) {
            pose.rotation[i] = joint.at[i] + (joint.by_sine[i] * sine + joint.by_cosine[i] * cosine);
            slack(pose.rotation[i], all(1.0));  // of the three numbers
        }
        pose.translation = {p[0] + none, p[1] + none, p[2] + none};
    } else {
        for (int i = 0; i < 9; ++i) pose.rotation[i] = joint.at[i] + none;
        const double* way = joint.way;
        pose.translation = {p[0] + way[0] * value, p[1] + way[1] * value, p[2] + way[2] * value};
        slack_by(pose.translation.x, value), slack_by(pose.translation.y, value), slack_by(pose.translation.z, value);
    }
    return pose;
}

// How a frame moves, in its own axes: angular velocity and acceleration, and the acceleration of its origin.
template <class T>
struct Twist {
    Triple<T> rate, spin, acceleration;

    // The matrix B of accelerations a + B r at places r: [spin]x + [rate]x^2.
    void field(T* b) const {
        const T &x = rate.x, &y = rate.y, &z = rate.z;
        const T xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
        b[0] = -1.0 * (yy + zz), b[1] = xy - spin.z, b[2] = xz + spin.y;
        b[3] = xy + spin.z, b[4] = -1.0 * (xx + zz), b[5] = yz - spin.x;
        b[6] = xz - spin.y, b[7] = yz + spin.x, b[8] = -1.0 * (xx + yy);
    }
};

template <class T>
struct Wrench {
    Triple<T> force, moment;
};

template <class T>
INLINE Triple<T> by_matrix(const T* b, const Triple<double>& v) {
    return {v.x * b[0] + v.y * b[1] + v.z * b[2], v.x * b[3] + v.y * b[4] + v.z * b[5],
            v.x * b[6] + v.y * b[7] + v.z * b[8]};
}

// Force and moment about the origin of its frame that move a body so.
template <class T>
INLINE Wrench<T> wrench_of(const Twist<T>& twist, const Body& body) {
    T b[9], about[3];
    twist.field(b);
    const double* s = body.second;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        about[i] = s[3 * j + i] * b[3 * k + i] - s[3 * k + i] * b[3 * j + i] + s[4 * j] * b[3 * k + j] -
                   s[4 * k] * b[3 * j + k] + s[3 * j + k] * (b[4 * k] - b[4 * j]);
    }
    const Triple<T>& a = twist.acceleration;
    const Triple<double> first = plain(body.first);
    const Triple<T> mass_times = {body.mass * a.x, body.mass * a.y, body.mass * a.z};
    const Triple<T> turning = cross(a, first);  // less first x a
    const Triple<T> moment = {about[0] - turning.x, about[1] - turning.y, about[2] - turning.z};
    return {mass_times + by_matrix(b, first), moment};
}

// Torques (or forces) of the joints in states: angles, velocities, accelerations, k of each after the other.
template <class T>
class NewtonEuler {
public:
    explicit NewtonEuler(const Chain& chain)
        : state(3 * chain.bodies.size()), torques(chain.bodies.size()), chain_(chain), poses_(chain.bodies.size()),
          twists_(chain.bodies.size() + 1), wrenches_(chain.bodies.size()), felt_(chain.bodies.size() + 1),
          feels_(chain.bodies.size() + 1) {}

    // With a share of gravity.
    void compute(double share) {
        const int k = (int)chain_.bodies.size();
        const T none = 0.0 * state[0];
        const Triple<T> zero = {none, none, none};
        const double* g = chain_.gravity;
        twists_[0] = {zero, zero, {-share * g[0] + none, -share * g[1] + none, -share * g[2] + none}};
        for (int i = 0; i < k; ++i) {
            const Body& body = chain_.bodies[i];
            const Twist<T>& before = twists_[body.joint.parent];
            poses_[i] = pose_of(body.joint, state[i]);
            twists_[i + 1] = carried(before, poses_[i], body.joint, state[k + i], state[2 * k + i]);
            wrenches_[i] = wrench_of(twists_[i + 1], body);
            felt_[i + 1] = {zero, zero}, feels_[i + 1] = false;
        }
        for (int i = k - 1; i >= 0; --i) {
            const Wrench<T>& beyond = felt_[i + 1];
            const Wrench<T> sum = {wrenches_[i].force + beyond.force, wrenches_[i].moment + beyond.moment};
            const Joint& joint = chain_.bodies[i].joint;
            const Triple<T>& felt = joint.turns ? sum.moment : sum.force;
            torques[i] = joint.axis[0] * felt.x + joint.axis[1] * felt.y + joint.axis[2] * felt.z;
            if (!joint.parent) continue;
            const Triple<T> force = poses_[i].turned(sum.force);
            feel(joint.parent, {force, poses_[i].turned(sum.moment) + cross(poses_[i].translation, force)});
        }
    }

    std::vector<T> state, torques;

private:
    // What a body passes on to the one that it is on; added to what others pass on.
    void feel(int body, const Wrench<T>& more) {
        Wrench<T>& sum = felt_[body];
        sum = feels_[body] ? Wrench<T>{sum.force + more.force, sum.moment + more.moment} : more;
        feels_[body] = true;
    }

    // How the frame of a joint moves, from how that of the body that it is on does.
    static Twist<T> carried(const Twist<T>& before, const Pose<T>& pose, const Joint& joint, const T& speed,
                            const T& faster) {
        T b[9];
        before.field(b);
        const Triple<T>& p = pose.translation;
        const Triple<T> origin = before.acceleration + Triple<T>{b[0] * p.x + b[1] * p.y + b[2] * p.z,
                                                                 b[3] * p.x + b[4] * p.y + b[5] * p.z,
                                                                 b[6] * p.x + b[7] * p.y + b[8] * p.z};
        const Triple<T> rate = pose.turned_back(before.rate), spin = pose.turned_back(before.spin);
        const Triple<T> acceleration = pose.turned_back(origin), along = scaled(joint.axis, speed);
        const Triple<T> more = scaled(joint.axis, faster), turning = cross(rate, along);
        if (joint.turns) return {rate + along, spin + more + turning, acceleration};
        return {rate, spin, acceleration + more + turning + turning};
    }

    const Chain& chain_;
    std::vector<Pose<T>> poses_;
    std::vector<Twist<T>> twists_;               // of all bodies
    std::vector<Wrench<T>> wrenches_, felt_;     // of each joint's body; what others pass on to a body
    std::vector<char> feels_;                    // whether any does
};

}  // namespace core
