// Vectors and quaternions in single precision, with the names and habits of a graphics library.
#pragma once
#include <cmath>
#define GLM_VERSION 1000
namespace glm {
enum qualifier { highp };
template <int n, class T, qualifier Q> struct vec {
    T x, y, z;
    T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
};
template <class T, qualifier Q> struct qua { T w, x, y, z; };
using vec3 = vec<3, float, highp>;
using quat = qua<float, highp>;

inline vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline vec3 operator*(float s, vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float length(vec3 a) { return std::sqrt(dot(a, a)); }
inline float distance(vec3 a, vec3 b) { return length(a - b); }
inline vec3 normalize(vec3 a) { return (1 / length(a)) * a; }
inline vec3 cross(vec3 a, vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline quat conjugate(quat q) { return {q.w, -q.x, -q.y, -q.z}; }
inline quat normalize(quat q) {
    float n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {q.w / n, q.x / n, q.y / n, q.z / n};
}
inline quat operator*(quat a, quat b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline vec3 operator*(quat q, vec3 v) {
    vec3 u{q.x, q.y, q.z}, t = 2.f * cross(u, v);
    return v + q.w * t + cross(u, t);
}
// The rotation from one direction to another; none if they are nearly the same.
inline quat rotation(vec3 from, vec3 to) {
    float cosine = dot(from, to);
    if (cosine >= 1 - 1.1920929e-7f) return {1, 0, 0, 0};
    if (cosine < -1 + 1.1920929e-7f) {
        vec3 axis = cross(vec3{0, 0, 1}, from);
        if (dot(axis, axis) < 1.1920929e-7f) axis = cross(vec3{1, 0, 0}, from);
        axis = normalize(axis);
        return {0, axis.x, axis.y, axis.z};
    }
    vec3 axis = cross(from, to);
    float s = std::sqrt((1 + cosine) * 2);
    return {s * 0.5f, axis.x / s, axis.y / s, axis.z / s};
}
}  // namespace glm
