#pragma once

#include "core/error.h"
#include "graph/compile.h"

#include <map>

namespace trilume::graph {

/// An access with the versions around it: `before` is 0 where the node created the resource.
struct VersionedAccess {
    uint32_t resource;
    uint32_t before, after;
    bool reads = false, writes = false;
};

/// What one node declared.
struct Declaration {
    std::vector<VersionedAccess> accesses;
    std::vector<PathClass> owned;
    bool sideEffect = false;
    std::vector<std::string> missing; ///< looked for, not found
};

/// Records the declarations of all nodes in order and checks each as it comes.
class Recorder final : public Builder {
public:
    /// `passes` tells, for messages, why a resource is missing. Both outlive the recorder.
    Recorder(const CompileInput& input, const std::vector<Pass>& passes);

    /// Runs one node's declare; its accesses become `declarations()[pass]`.
    void declare(uint32_t pass, Node& node);
    /// Throws what the declarations did wrong, as one error.
    void throwErrors() const;

    const std::vector<Declaration>& declarations() const { return declarations_; }
    std::vector<ResourceInfo>& resources() { return resources_; }
    /// The pass that made version `version` (from 1) of a resource.
    uint32_t producer(uint32_t resource, uint32_t version) const { return producers_[resource][version - 1]; }
    uint32_t lastProducer(uint32_t resource) const { return producers_[resource].back(); }
    std::optional<uint32_t> find(std::string_view name) const;
    /// Why nobody made a resource: its node (the name up to the dot) was culled, made something else, or isn't there.
    std::string whyMissing(std::string_view name) const;

    Plane createPlane(std::string_view name, uint32_t bytesPerPixel) override;
    Buffer createBuffer(std::string_view name, size_t bytes) override;
    History<Plane> historyPlane(std::string_view name, uint32_t bytesPerPixel) override;
    History<Buffer> historyBuffer(std::string_view name, size_t bytes) override;
    Buffer persistentBuffer(std::string_view name, size_t bytes) override;
    Plane findPlane(std::string_view name) const override;
    Buffer findBuffer(std::string_view name) const override;
    void read(Plane plane) override { recordRead(plane); }
    void read(Buffer buffer) override { recordRead(buffer); }
    Plane write(Plane plane) override { return recordWrite(plane); }
    Buffer write(Buffer buffer) override { return recordWrite(buffer); }
    void owns(PathClass pathClass) override;
    void sideEffect() override;
    std::vector<Plane> findPlanes(std::string_view suffix) const override;
    const std::string& nameOf(Plane plane) const override;
    const ParamSet& params() const override { return input_.params; }
    const SceneFacts& facts() const override { return input_.facts; }
    uint32_t width() const override { return input_.width; }
    uint32_t height() const override { return input_.height; }

private:
    template<class H>
    H create(ResourceInfo info);
    template<class H>
    History<H> createHistory(const ResourceInfo& info);
    template<class H>
    H findHandle(std::string_view name) const;
    template<class H>
    void recordRead(H handle);
    template<class H>
    H recordWrite(H handle);
    /// Whether the handle names the latest version of a resource of this graph; else an error is on record.
    template<class H>
    bool check(H handle, std::string_view verb);
    VersionedAccess& access(uint32_t resource);
    uint32_t latest(uint32_t resource) const { return static_cast<uint32_t>(producers_[resource].size()); }
    size_t planeBytes(uint32_t bytesPerPixel) const { return size_t{bytesPerPixel} * input_.width * input_.height; }
    /// Keeps the node's first error: what follows it is mostly its echo.
    void fail(Fault fault, std::string_view problem, std::string_view resource, std::string_view hint);

    const CompileInput& input_;
    const std::vector<Pass>& passes_;
    uint32_t pass_ = 0;
    mutable std::vector<Declaration> declarations_; ///< the finds, which are const for authors, note what is missing
    std::vector<ResourceInfo> resources_;
    std::vector<std::vector<uint32_t>> producers_; ///< by resource and version
    std::map<std::string, uint32_t, std::less<>> byName_;
    std::map<uint32_t, Error> errors_; ///< by pass
};

} // namespace trilume::graph
