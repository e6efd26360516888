#include "rt/bvh.h"

#include "core/error.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace trilume::rt {
namespace {

using shared::BvhNode;

constexpr uint32_t kArity = 4;
constexpr uint32_t kBins = 16;
constexpr size_t kParallelBinning = 1 << 16; // primitives from which one range is binned by several threads
constexpr size_t kParallelBranch = 1 << 12;  // primitives from which children are built by several threads

/// What the builder moves around: 32 bytes, so that two share a cache line.
struct Reference {
    glm::vec3 min;
    uint32_t primitive;
    glm::vec3 max;
    uint32_t padding;

    glm::vec3 doubleCentroid() const { return min + max; }
    Box box() const { return {min, max}; }
};

/// A set of primitives on its way to become a child: `bounds` of the primitives, `centroids` of their doubled
/// centroids.
struct Range {
    uint32_t begin = 0, end = 0;
    Box bounds, centroids;
    uint32_t size() const { return end - begin; }
};

struct Split {
    float cost = std::numeric_limits<float>::infinity(); ///< of both sides' primitives, times the range's half area
    int axis = -1;                                       ///< negative: no plane separates the centroids
    uint32_t plane = 0;                                  ///< bins below go left
};

/// Maps doubled centroids to bins on each axis.
struct Binning {
    glm::vec3 origin, scale;

    explicit Binning(const Box& centroids) : origin(centroids.min) {
        // Slightly less than kBins, so that the greatest centroid falls into the last bin; 0 on axes without extent.
        const glm::vec3 extent = centroids.max - centroids.min;
        for (int axis = 0; axis < 3; ++axis) {
            const float s = kBins * (1.0f - 1e-6f) / extent[axis];
            scale[axis] = std::isfinite(s) ? s : 0.0f;
        }
    }
    uint32_t bin(const Reference& reference, int axis) const {
        const float at = (reference.min[axis] + reference.max[axis] - origin[axis]) * scale[axis];
        return std::min(static_cast<uint32_t>(at), kBins - 1);
    }
};

struct Bins {
    std::array<std::array<Box, kBins>, 3> boxes;
    std::array<std::array<uint32_t, kBins>, 3> counts{};

    void add(const Binning& binning, std::span<const Reference> references) {
        for (const Reference& r : references) {
            for (int axis = 0; axis < 3; ++axis) {
                const uint32_t bin = binning.bin(r, axis);
                boxes[axis][bin].grow(r.box());
                ++counts[axis][bin];
            }
        }
    }
    void add(const Bins& other) {
        for (int axis = 0; axis < 3; ++axis) {
            for (uint32_t bin = 0; bin < kBins; ++bin) {
                boxes[axis][bin].grow(other.boxes[axis][bin]);
                counts[axis][bin] += other.counts[axis][bin];
            }
        }
    }
    Split best(const Binning& binning) const {
        Split split;
        for (int axis = 0; axis < 3; ++axis) {
            if (binning.scale[axis] == 0.0f) continue;
            std::array<float, kBins> rightCost{};
            Box box;
            uint32_t count = 0;
            for (uint32_t bin = kBins - 1; bin > 0; --bin) {
                box.grow(boxes[axis][bin]);
                count += counts[axis][bin];
                rightCost[bin] = box.halfArea() * static_cast<float>(count);
            }
            const uint32_t total = count + counts[axis][0];
            box = {};
            count = 0;
            for (uint32_t plane = 1; plane < kBins; ++plane) {
                box.grow(boxes[axis][plane - 1]);
                count += counts[axis][plane - 1];
                const float cost = box.halfArea() * static_cast<float>(count) + rightCost[plane];
                if (count > 0 && count < total && cost < split.cost) split = {cost, axis, plane};
            }
        }
        return split;
    }
};

/// Writes a child's box into the node's bytes: outward rounding, so decoded boxes contain the given ones.
void quantise(BvhNode& node, std::span<const Box> children) {
    Box bounds;
    for (const Box& child : children) bounds.grow(child);
    if (bounds.empty()) bounds = {glm::vec3(0), glm::vec3(0)};
    node.origin = bounds.min;
    node.exponents = 0;
    uint32_t* const lows[3] = {&node.lowX, &node.lowY, &node.lowZ};
    uint32_t* const highs[3] = {&node.highX, &node.highY, &node.highZ};
    for (int axis = 0; axis < 3; ++axis) {
        // The least power of two of which 255 span the extent; exact in double precision.
        const double extent = double(bounds.max[axis]) - double(bounds.min[axis]);
        int exponent = 1 - 127;
        if (extent > 0.0) exponent = std::clamp(std::ilogb(extent / 255.0), 1 - 127, 127);
        if (std::ldexp(255.0, exponent) < extent) ++exponent;
        node.exponents |= static_cast<uint32_t>(exponent + 127) << (8 * axis);
        *lows[axis] = *highs[axis] = 0;
        for (uint32_t c = 0; c < kArity; ++c) {
            uint32_t low = 255, high = 0; // hit by nothing
            if (c < children.size() && !children[c].empty()) {
                const double from = double(children[c].min[axis]) - double(bounds.min[axis]);
                const double to = double(children[c].max[axis]) - double(bounds.min[axis]);
                low = static_cast<uint32_t>(std::clamp(std::floor(std::ldexp(from, -exponent)), 0.0, 255.0));
                high = static_cast<uint32_t>(std::clamp(std::ceil(std::ldexp(to, -exponent)), 0.0, 255.0));
            }
            *lows[axis] |= low << (8 * c);
            *highs[axis] |= high << (8 * c);
        }
    }
}

uint32_t leafChild(uint32_t first, uint32_t count) {
    return shared::kBvhLeafBit | (count << shared::kBvhLeafCountShift) | first;
}
bool isLeaf(uint32_t child) { return (child & shared::kBvhLeafBit) != 0; }
uint32_t leafFirst(uint32_t child) { return child & shared::kBvhLeafFirstMask; }
uint32_t leafCount(uint32_t child) { return (child >> shared::kBvhLeafCountShift) & shared::kBvhLeafCountMask; }

/// What a node's children add to the cost: area times the cost of testing what is in them.
double nodeCost(std::span<const Box> boxes, const BvhNode& node, const BvhOptions& options) {
    double cost = 0.0;
    for (size_t c = 0; c < boxes.size(); ++c) {
        const uint32_t child = node.children[c];
        const double inside = isLeaf(child) ? double(leafCount(child)) : double(options.traversalCost);
        cost += double(boxes[c].halfArea()) * inside;
    }
    return cost;
}

/// `sum` of nodeCost over all nodes, as the cost of a ray that hits the bounds.
float expectedCost(double sum, const Box& bounds, const BvhOptions& options) {
    const double area = bounds.halfArea();
    return static_cast<float>(options.traversalCost + (area > 0.0 ? sum / area : 0.0));
}

class Builder {
public:
    Builder(std::vector<Reference> references, const BvhOptions& options, TaskPool& pool)
        : references_(std::move(references)), options_(options), pool_(pool) {}

    Bvh build() {
        const uint64_t most = std::min<uint64_t>(capacity(options_.maxDepth), shared::kBvhLeafFirstMask);
        if (references_.size() > most) {
            throw inputError(fmt::format("{} primitives in one BVH", references_.size()), "acceleration structure",
                             fmt::format("split the scene: {} is the most", most));
        }
        Bvh bvh;
        bvh.order.resize(references_.size());
        Range all = measure(0, static_cast<uint32_t>(references_.size()));
        bvh.bounds = all.bounds;
        // A subtree over n primitives has at most n - 1 nodes, so every subtree knows its slots beforehand and threads
        // need not agree on anything. Pages of unused slots are never touched.
        nodes_ = std::make_unique_for_overwrite<WideNode[]>(std::max<size_t>(references_.size(), 1));
        if (all.size() <= 1) {
            nodes_[0] = {};
            if (all.size() == 1) nodes_[0].add(all.bounds, leafChild(0, 1));
        } else {
            buildNode(all, 0, 0);
        }
        for (size_t i = 0; i < references_.size(); ++i) bvh.order[i] = references_[i].primitive;
        emit(bvh);
        return bvh;
    }

private:
    struct WideNode {
        std::array<Box, kArity> boxes;
        std::array<uint32_t, kArity> children;
        uint32_t count = 0;
        void add(const Box& box, uint32_t child) {
            boxes[count] = box;
            children[count++] = child;
        }
    };

    /// A range with the best way to split it.
    struct Candidate {
        Range range;
        Split split;
        Binning binning{Box{glm::vec3(0), glm::vec3(0)}};
        bool leaf = false;
    };

    Range measure(uint32_t begin, uint32_t end) {
        Range range{begin, end};
        for (uint32_t i = begin; i < end; ++i) {
            range.bounds.grow(references_[i].box());
            range.centroids.grow(references_[i].doubleCentroid());
        }
        return range;
    }

    Candidate consider(const Range& range) {
        Candidate candidate{range, {}, Binning(range.centroids)};
        const uint32_t n = range.size();
        if (n == 1) {
            candidate.leaf = true;
            return candidate;
        }
        const std::span<const Reference> references(references_.data() + range.begin, n);
        if (n >= kParallelBinning && pool_.threadCount() > 1) {
            // Chunks are summed in their own order: minima, maxima and counts are exact, so the order can't show.
            const size_t grain = (n + 2 * pool_.threadCount() - 1) / (2 * pool_.threadCount());
            std::vector<Bins> parts((n + grain - 1) / grain);
            pool_.parallelFor(n, grain, [&](size_t begin, size_t end) {
                parts[begin / grain].add(candidate.binning, references.subspan(begin, end - begin));
            });
            for (size_t i = 1; i < parts.size(); ++i) parts[0].add(parts[i]);
            candidate.split = parts[0].best(candidate.binning);
        } else {
            Bins bins;
            bins.add(candidate.binning, references);
            candidate.split = bins.best(candidate.binning);
        }
        const float area = range.bounds.halfArea();
        const float splitCost = candidate.split.cost + options_.traversalCost * area;
        candidate.leaf = n <= options_.maxLeafSize && !(splitCost < area * static_cast<float>(n));
        return candidate;
    }

    /// Reorders the candidate's references into two ranges, neither empty.
    std::array<Range, 2> divide(const Candidate& candidate, bool median) {
        const Range& range = candidate.range;
        const auto begin = references_.begin() + range.begin, end = references_.begin() + range.end;
        auto middle = begin + range.size() / 2;
        if (!median && candidate.split.axis >= 0) {
            const auto& [cost, axis, plane] = candidate.split;
            middle = std::partition(begin, end, [&, axis = axis, plane = plane](const Reference& r) {
                return candidate.binning.bin(r, axis) < plane;
            });
        } else {
            const glm::vec3 extent = range.centroids.max - range.centroids.min;
            const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
            std::nth_element(begin, middle, end, [axis](const Reference& a, const Reference& b) {
                const float x = a.min[axis] + a.max[axis], y = b.min[axis] + b.max[axis];
                return x != y ? x < y : a.primitive < b.primitive;
            });
        }
        const auto at = static_cast<uint32_t>(middle - references_.begin());
        return {measure(range.begin, at), measure(at, range.end)};
    }

    /// How many primitives `levels` inner levels hold when every split is a median; saturates.
    uint64_t capacity(uint32_t levels) const {
        return levels >= 16 ? std::numeric_limits<uint64_t>::max() : uint64_t(options_.maxLeafSize) << (2 * levels);
    }

    /// Builds the node of `range` into `slot`, with room for range.size() - 1 nodes from there on.
    void buildNode(const Range& range, uint32_t slot, uint32_t depth) {
        // Invariant: range.size() <= capacity(maxDepth - depth). A SAH split may leave all primitives but one in a
        // child, a median split leaves each child a quarter.
        const bool median = range.size() - 1 > capacity(options_.maxDepth - depth - 1);
        std::array<Candidate, kArity> children{consider(range)};
        children[0].leaf = false;
        uint32_t count = 1;
        while (count < kArity) {
            Candidate* widest = nullptr;
            auto size = [median](const Candidate& c) {
                return median ? static_cast<float>(c.range.size()) : c.range.bounds.halfArea();
            };
            for (uint32_t c = 0; c < count; ++c) {
                if (!children[c].leaf && (!widest || size(children[c]) > size(*widest))) widest = &children[c];
            }
            if (!widest) break;
            const auto [left, right] = divide(*widest, median);
            *widest = consider(left);
            children[count++] = consider(right);
        }

        WideNode& node = nodes_[slot];
        node = {};
        std::array<uint32_t, kArity> slots{};
        uint32_t nextSlot = slot + 1;
        for (uint32_t c = 0; c < count; ++c) {
            const Range& r = children[c].range;
            if (depth + 1 == options_.maxDepth) children[c].leaf = true; // small enough, by the invariant
            slots[c] = nextSlot;
            nextSlot += r.size() - 1;
            node.add(r.bounds, children[c].leaf ? leafChild(r.begin, r.size()) : slots[c]);
        }
        auto descend = [&](uint32_t c) {
            if (c < count && !children[c].leaf) buildNode(children[c].range, slots[c], depth + 1);
        };
        if (range.size() >= kParallelBranch) {
            pool_.invoke([&] { pool_.invoke([&] { descend(0); }, [&] { descend(1); }); },
                         [&] { pool_.invoke([&] { descend(2); }, [&] { descend(3); }); });
        } else {
            for (uint32_t c = 0; c < count; ++c) descend(c);
        }
    }

    /// Packs the used slots, depth first.
    void emit(Bvh& bvh) {
        struct Entry {
            uint32_t slot, parent, child, depth;
        };
        std::vector<Entry> stack{{0, 0, 0, 1}};
        bvh.nodes.reserve(references_.size() / 2 + 1);
        double cost = 0.0;
        while (!stack.empty()) {
            const Entry entry = stack.back();
            stack.pop_back();
            const auto index = static_cast<uint32_t>(bvh.nodes.size());
            if (index > 0) bvh.nodes[entry.parent].children[entry.child] = index;
            bvh.depth = std::max(bvh.depth, entry.depth);
            const WideNode& wide = nodes_[entry.slot];
            BvhNode& node = bvh.nodes.emplace_back();
            quantise(node, std::span(wide.boxes).first(wide.count));
            for (uint32_t c = kArity; c-- > 0;) {
                node.children[c] = c < wide.count ? wide.children[c] : shared::kBvhEmpty;
                if (!isLeaf(node.children[c])) stack.push_back({wide.children[c], index, c, entry.depth + 1});
            }
            cost += nodeCost(std::span(wide.boxes).first(wide.count), node, options_);
        }
        if (bvh.nodes.size() > shared::kBvhNodeLimit) {
            throw inputError(fmt::format("{} primitives in one BVH", references_.size()), "acceleration structure",
                             "split the scene into smaller meshes");
        }
        bvh.cost = expectedCost(cost, bvh.bounds, options_);
    }

    std::vector<Reference> references_;
    BvhOptions options_;
    TaskPool& pool_;
    std::unique_ptr<WideNode[]> nodes_;
};

/// Up to this magnitude areas and doubled centroids stay finite in single precision.
constexpr float kGreatest = 1e18f;

bool usable(glm::vec3 v) {
    return std::abs(v.x) <= kGreatest && std::abs(v.y) <= kGreatest && std::abs(v.z) <= kGreatest;
}

} // namespace

Bvh buildBvh(std::span<const Box> boxes, const BvhOptions& options, TaskPool& pool) {
    std::vector<Reference> references;
    references.reserve(boxes.size());
    for (size_t i = 0; i < boxes.size(); ++i) {
        if (!boxes[i].empty()) references.push_back({boxes[i].min, static_cast<uint32_t>(i), boxes[i].max, 0});
    }
    return Builder(std::move(references), options, pool).build();
}

void refitBvh(Bvh& bvh, std::span<const Box> boxes, const BvhOptions& options, std::span<const uint8_t> moved) {
    const bool all = moved.empty() || bvh.refits.empty();
    bvh.refits.resize(bvh.nodes.size());
    std::vector<uint8_t> stale(bvh.nodes.size(), all);
    double cost = 0.0;
    // Children stand after their parents.
    for (size_t i = bvh.nodes.size(); i-- > 0;) {
        BvhNode& node = bvh.nodes[i];
        Bvh::Refit& refit = bvh.refits[i];
        for (uint32_t c = 0; c < kArity && !stale[i]; ++c) {
            const uint32_t child = node.children[c];
            const auto primitives = bvh.order.begin() + (isLeaf(child) ? leafFirst(child) : 0);
            stale[i] = isLeaf(child) ? std::any_of(primitives, primitives + leafCount(child),
                                                   [&](uint32_t primitive) { return moved[primitive] != 0; })
                                     : stale[child] != 0;
        }
        if (stale[i]) {
            std::array<Box, kArity> children;
            refit.box = {};
            for (uint32_t c = 0; c < kArity; ++c) {
                const uint32_t child = node.children[c];
                if (!isLeaf(child)) {
                    children[c] = bvh.refits[child].box;
                } else {
                    for (uint32_t k = 0; k < leafCount(child); ++k)
                        children[c].grow(boxes[bvh.order[leafFirst(child) + k]]);
                }
                refit.box.grow(children[c]);
            }
            quantise(node, children);
            refit.cost = nodeCost(children, node, options);
        }
        cost += refit.cost;
    }
    bvh.bounds = bvh.refits[0].box;
    bvh.cost = expectedCost(cost, bvh.bounds, options);
}

TriangleInput triangleBoxes(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                            TaskPool& pool) {
    constexpr size_t kGrain = 1 << 15;
    TriangleInput input;
    input.boxes.resize(triangles.size());
    struct Counts {
        uint32_t invalid = 0, degenerate = 0;
    };
    std::vector<Counts> counts((triangles.size() + kGrain - 1) / kGrain);
    pool.parallelFor(triangles.size(), kGrain, [&](size_t begin, size_t end) {
        Counts& count = counts[begin / kGrain];
        for (size_t i = begin; i < end; ++i) {
            const glm::uvec3 t = triangles[i];
            if (std::max({t.x, t.y, t.z}) >= positions.size()) {
                ++count.invalid;
                continue;
            }
            const glm::vec3 a = positions[t.x], b = positions[t.y], c = positions[t.z];
            if (!usable(a) || !usable(b) || !usable(c)) {
                ++count.invalid;
            } else if (const glm::dvec3 normal =
                           glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a));
                       normal == glm::dvec3(0)) {
                ++count.degenerate;
            } else {
                input.boxes[i].grow(a);
                input.boxes[i].grow(b);
                input.boxes[i].grow(c);
            }
        }
    });
    for (const Counts& count : counts) {
        input.invalid += count.invalid;
        input.degenerate += count.degenerate;
    }
    input.usable = static_cast<uint32_t>(triangles.size()) - input.invalid - input.degenerate;
    return input;
}

std::array<glm::dvec3, 2> childBox(const BvhNode& node, uint32_t child) {
    const uint32_t lows[3] = {node.lowX, node.lowY, node.lowZ}, highs[3] = {node.highX, node.highY, node.highZ};
    std::array<glm::dvec3, 2> box;
    for (int axis = 0; axis < 3; ++axis) {
        const int exponent = static_cast<int>((node.exponents >> (8 * axis)) & 0xff) - 127;
        box[0][axis] = node.origin[axis] + std::ldexp(double((lows[axis] >> (8 * child)) & 0xff), exponent);
        box[1][axis] = node.origin[axis] + std::ldexp(double((highs[axis] >> (8 * child)) & 0xff), exponent);
    }
    return box;
}

} // namespace trilume::rt
