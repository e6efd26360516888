#pragma once

#include "gpu/device.h"
#include "params/params.h"
#include "shared/frame.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trilume::graph {

/// Light paths, light to eye, by the regular expression of Heckbert; see algorithms.md. Each belongs to one class, each
/// class to one enabled node.
enum class PathClass : uint32_t {
    Emission, ///< L S* E
    Direct,   ///< L D S* E
    Caustic,  ///< L S+ D S* E
    Indirect, ///< two or more D
    Count
};
const char* pathClassName(PathClass c);

/// Per-frame resources are regions of device memory, reached by address. A handle names a resource and the version
/// that a write made; reading a retired version is an error when the graph compiles.
template<class Tag>
struct Handle {
    uint32_t resource = ~0u;
    uint32_t version = 0;
    explicit operator bool() const { return resource != ~0u; }
};
using Plane = Handle<struct PlaneTag>;   ///< one element per pixel of the view, row-major, row 0 at the top
using Buffer = Handle<struct BufferTag>; ///< a number of bytes

/// A pair that swaps each frame. `previous` is what `current` was last frame; not to be read unless valid then
/// (Resources::historyValid). Its creator need not declare the read; other nodes find it as `name.previous` and do.
template<class H>
struct History {
    H current, previous;
};

/// What a node can tell about the scene without rendering it; kept up to date from changes.
struct SceneFacts {
    uint32_t lights = 0;          ///< sampled lights, emissive triangles included
    uint32_t specularCasters = 0; ///< instances whose material has a lobe below the roughness threshold
    uint32_t instances = 0;
    uint32_t dynamicInstances = 0; ///< moved or deformed since last frame
    uint32_t changedLights = 0;
    bool environment = false;   ///< a dome light
    bool diffuseAlbedo = false; ///< some material reflects diffusely
    bool transparent = false;   ///< some material transmits or is cut out
    bool textured = false;
    bool rough = false; ///< some material reflects glossily, in a lobe that is no delta
    bool cameraMoved = false;
    bool sceneChanged = false;     ///< anything at all since last frame
    bool geometryChanged = false;  ///< of that, shapes or their places: moved, deformed, added, removed
    uint64_t lightingRevision = 0; ///< grows with each change of lights, things or materials, not with the camera
    glm::vec3 boundsMin{0}, boundsMax{0}; ///< of everything finite, render space, metres; equal where there is nothing
    glm::vec3 cameraPosition{0};          ///< render space
};

/// A node's answer to "are you needed here?"; the reason shows in the stats and the editor: why not, or, of a node that
/// runs, what it does not do here.
struct Need {
    bool needed = true;
    std::string reason;
    static Need yes() { return {}; }
    static Need no(std::string reason) { return {false, std::move(reason)}; }
};

/// What a node says of itself for one graph. Errors are collected and thrown by compile, naming node and resource.
class Builder {
public:
    virtual ~Builder() = default;

    /// A new resource that this node writes first; `name` is `node.signal` and unique in the graph.
    [[nodiscard]] virtual Plane createPlane(std::string_view name, uint32_t bytesPerPixel) = 0;
    [[nodiscard]] virtual Buffer createBuffer(std::string_view name, size_t bytes) = 0;
    [[nodiscard]] virtual History<Plane> historyPlane(std::string_view name, uint32_t bytesPerPixel) = 0;
    [[nodiscard]] virtual History<Buffer> historyBuffer(std::string_view name, size_t bytes) = 0;
    /// One copy that stays in place from frame to frame, for state of which each frame updates a part. Holds last
    /// frame's data where Resources::historyValid(buffer); otherwise the node fills it.
    [[nodiscard]] virtual Buffer persistentBuffer(std::string_view name, size_t bytes) = 0;

    /// The latest version of a resource that an earlier node made; a null handle when there is none, which a node may
    /// take as "do without": reading or writing it is an error.
    virtual Plane findPlane(std::string_view name) const = 0;
    virtual Buffer findBuffer(std::string_view name) const = 0;
    virtual void read(Plane plane) = 0;
    virtual void read(Buffer buffer) = 0;
    /// Retires the handle and gives the new version.
    [[nodiscard]] virtual Plane write(Plane plane) = 0;
    [[nodiscard]] virtual Buffer write(Buffer buffer) = 0;

    /// Each path class has one owner among the enabled nodes.
    virtual void owns(PathClass pathClass) = 0;
    /// The node has effects outside the graph (the output image): it and what it reads are never culled as unused.
    virtual void sideEffect() = 0;
    /// All planes whose name ends in `suffix`, in order of creation: how composite finds ".radiance" signals.
    virtual std::vector<Plane> findPlanes(std::string_view suffix) const = 0;
    virtual const std::string& nameOf(Plane plane) const = 0;

    virtual const ParamSet& params() const = 0;
    virtual const SceneFacts& facts() const = 0;
    virtual uint32_t width() const = 0;
    virtual uint32_t height() const = 0;
};

/// Where resources stand while a node executes.
class Resources {
public:
    virtual ~Resources() = default;
    /// 0 for a null handle, so that shaders can test for an optional input. Throws runError for what was not declared.
    virtual VkDeviceAddress address(Plane plane) const = 0;
    virtual VkDeviceAddress address(Buffer buffer) const = 0;
    /// Whether `previous` of a history pair, or a persistent buffer, holds last frame's data: not on the first frame,
    /// after a resize (planes; buffers when their size changed), a reset, or a frame in which the node did not run.
    virtual bool historyValid(Plane previous) const = 0;
    virtual bool historyValid(Buffer previousOrPersistent) const = 0;
};

/// Threads to dispatch for at least `threads` of a pass that spreads its groups (shaders/scene/pass.glsl, spreadGroup).
constexpr uint32_t spread(uint32_t threads) {
    constexpr uint32_t kStep = shared::kGroupSpread * shared::kSpreadGroupSize;
    return (threads + kStep - 1) / kStep * kStep;
}

/// What a node needs to execute beside its resources.
struct FrameContext {
    gpu::Commands& commands;
    const Resources& resources;
    const ParamSet& params;
    const SceneFacts& facts;
    VkDeviceAddress frame = 0; ///< FrameConstants (shaders/shared/frame.h)
    uint32_t width = 0, height = 0;
    uint32_t sampleIndex = 0; ///< frames since averaging began: 0 restarts the sums
    bool repeats =
        false; ///< the frame before was of the same picture: what `facts` say moved or changed did so earlier
    /// Compiled on first use and kept; defines of the tracer backend and specialisation are added by the renderer.
    std::function<const gpu::Pipeline&(const gpu::ShaderSource&)> pipeline;
};

/// One node: declare says what, execute only dispatches. Barriers, lifetimes, aliasing and timing belong to the graph.
class Node {
public:
    virtual ~Node() = default;
    virtual Need needed(const SceneFacts& /*facts*/, const ParamSet& /*params*/) const { return Need::yes(); }
    virtual void declare(Builder& builder) = 0;
    virtual void execute(FrameContext& context) = 0;
};

} // namespace trilume::graph
