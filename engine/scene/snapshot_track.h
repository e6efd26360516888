#pragma once

#include "scene/snapshot_fields.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

/// Values over time: keys, and between two of them what USD does between samples.
namespace trilume::snapshot {

template<class T>
struct Track {
    uint32_t target = 0; ///< entity, material or mesh
    std::vector<double> times;
    std::vector<Blend> blends; ///< from each key on
    std::vector<T> values;

    T at(double time) const;
};

/// The floating point numbers of a field.
template<std::floating_point S>
std::span<const S> numbers(const S& value) {
    return {&value, 1};
}
inline std::span<const float> numbers(const glm::mat3x2& m) { return {&m[0][0], 6}; }
template<glm::length_t L, std::floating_point S>
std::span<const S> numbers(const glm::vec<L, S>& v) {
    return {&v[0], L};
}
template<glm::length_t L, std::floating_point S>
std::span<const S> numbers(const std::vector<glm::vec<L, S>>& v) {
    return {reinterpret_cast<const S*>(v.data()), v.size() * L};
}
template<class T>
concept Numeric = requires(const T& value) {
    numbers(value);
};

/// Whether all fields have the same bits.
struct Same {
    bool equal = true;

    template<class T>
    void operator()(const T& a, const T& b) {
        if constexpr (Record<T>)
            fields(*this, a, b);
        else if constexpr (Numeric<T>)
            equal =
                equal && numbers(a).size() == numbers(b).size() &&
                (numbers(a).empty() || std::memcmp(numbers(a).data(), numbers(b).data(), numbers(a).size_bytes()) == 0);
        else
            equal = equal && a == b;
    }
};
template<class T>
bool same(const T& a, const T& b) {
    Same compare;
    compare(a, b);
    return compare.equal;
}

/// How far `found` is from `expected`, as a multiple of what is allowed: a share of the change from a to b, and what
/// rounding leaves. Infinite where what is no number differs.
struct Deviation {
    double share;
    double worst = 0;

    template<class T>
    void operator()(const T& found, const T& expected, const T& a, const T& b);
};
template<class T>
double deviation(const T& found, const T& expected, const T& a, const T& b, double share) {
    Deviation compare{share};
    compare(found, expected, a, b);
    return compare.worst;
}
/// Smooth normals follow points in a curve; what they are off by is shading alone.
inline double deviation(const MeshPoints& found, const MeshPoints& expected, const MeshPoints& a, const MeshPoints& b,
                        double share) {
    Deviation points{share}, normals{50 * share};
    points(found.positions, expected.positions, a.positions, b.positions);
    normals(found.normals, expected.normals, a.normals, b.normals);
    return std::max(points.worst, normals.worst);
}

/// Between a and b, alpha from 0 to 1.
template<class T>
T blended(T a, const T& b, double alpha, Blend blend);
glm::dmat4 rigidlyBlended(const glm::dmat4& a, const glm::dmat4& b, double alpha);
void normalize(std::vector<glm::vec3>& vectors);

// ---- implementation ----------------------------------------------------------------------------

template<class T>
void Deviation::operator()(const T& found, const T& expected, const T& a, const T& b) {
    if constexpr (Record<T>) {
        fields(*this, found, expected, a, b);
    } else if constexpr (Numeric<T>) {
        const auto f = numbers(found), e = numbers(expected), from = numbers(a), to = numbers(b);
        bool comparable = f.size() == e.size();
        double off = 0, change = 0, size = 0;
        for (size_t i = 0; comparable && i < f.size(); ++i) {
            size = std::max(size, std::abs(double(e[i])));
            if (std::memcmp(&f[i], &e[i], sizeof(f[i])) == 0) continue;
            const double difference = std::abs(double(f[i]) - double(e[i]));
            comparable = std::isfinite(difference);
            off = std::max(off, difference);
        }
        for (size_t i = 0; i < std::min(from.size(), to.size()); ++i)
            change = std::max(change, std::abs(double(to[i]) - double(from[i])));
        const double allowed = share * change + 1e-6 * size;
        if (!comparable || (off > 0 && !(allowed > 0)))
            worst = std::numeric_limits<double>::infinity();
        else if (off > 0)
            worst = std::max(worst, off / allowed);
    } else if (!(found == expected)) {
        worst = std::numeric_limits<double>::infinity();
    }
}

/// Towards b, rounding each product as USD does for vectors: between two samples of points, the same bits.
struct LinearBlend {
    double alpha;

    template<class T>
    void operator()(T& a, const T& b) const {
        if constexpr (Record<T>) {
            fields(*this, a, b);
        } else if constexpr (Numeric<T>) {
            const auto from = numbers(std::as_const(a)), to = numbers(b);
            if (from.size() != to.size()) return;
            using S = typename decltype(from)::value_type;
            S* out = const_cast<S*>(from.data());
            for (size_t i = 0; i < from.size(); ++i)
                out[i] = static_cast<S>((1 - alpha) * from[i]) + static_cast<S>(alpha * to[i]);
        }
    }
};

template<class T>
T blended(T a, const T& b, double alpha, Blend blend) {
    if (blend == Blend::Hold) return a;
    if constexpr (std::same_as<T, LocalTransform>)
        if (blend == Blend::Rigid) return {rigidlyBlended(a.parentFromLocal, b.parentFromLocal, alpha)};
    LinearBlend{alpha}(a, b);
    if constexpr (std::same_as<T, MeshPoints>) normalize(a.normals);
    return a;
}

template<class T>
T Track<T>::at(double time) const {
    const auto next = std::upper_bound(times.begin(), times.end(), time);
    if (next == times.begin()) return values.front();
    const size_t i = static_cast<size_t>(next - times.begin()) - 1;
    if (next == times.end() || times[i] == time) return values[i];
    return blended(values[i], values[i + 1], (time - times[i]) / (times[i + 1] - times[i]), blends[i]);
}

} // namespace trilume::snapshot
