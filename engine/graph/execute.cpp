#include "graph/execute.h"

#include "core/error.h"

#include <algorithm>

namespace trilume::graph {

namespace {

/// Resources as the pass at hand sees them: only what it declared.
class PassResources final : public Resources {
public:
    PassResources(const CompiledGraph& graph, size_t count) : graph_(graph), addresses_(count), valid_(count) {}

    void enter(const Pass& pass) { pass_ = &pass; }
    void set(size_t resource, VkDeviceAddress address, bool valid) {
        addresses_[resource] = address;
        valid_[resource] = valid;
    }

    VkDeviceAddress address(Plane plane) const override { return addressOf(plane.resource); }
    VkDeviceAddress address(Buffer buffer) const override { return addressOf(buffer.resource); }
    bool historyValid(Plane previous) const override { return validAt(previous.resource); }
    bool historyValid(Buffer previous) const override { return validAt(previous.resource); }

private:
    VkDeviceAddress addressOf(uint32_t resource) const {
        if (resource == Plane{}.resource) return 0;
        checkDeclared(resource);
        return addresses_[resource];
    }
    bool validAt(uint32_t resource) const {
        if (resource == Plane{}.resource) return false;
        checkDeclared(resource);
        return valid_[resource];
    }
    void checkDeclared(uint32_t resource) const {
        const auto matches = [&](const Access& access) { return access.resource == resource; };
        if (std::any_of(pass_->accesses.begin(), pass_->accesses.end(), matches)) return;
        throw runError("the node uses a resource that it did not declare",
                       pass_->name + ", " +
                           (resource < addresses_.size() ? graph_.resources[resource].name : "unknown handle"),
                       "read or write it in declare");
    }

    const CompiledGraph& graph_;
    const Pass* pass_ = nullptr;
    std::vector<VkDeviceAddress> addresses_;
    std::vector<bool> valid_;
};

std::string_view pairName(const ResourceInfo& resource) {
    std::string_view name = resource.name;
    if (resource.role == HistoryRole::Previous) name.remove_suffix(std::string_view(".previous").size());
    return name;
}

/// Whether memory of its own goes by the resource's name.
bool isKept(const ResourceInfo& resource) {
    return resource.used && (resource.role == HistoryRole::Current || resource.role == HistoryRole::Persistent);
}

} // namespace

void GraphExecutor::setGraph(CompiledGraph graph) {
    // An arena that is somewhat too large stays: nodes that come and go shouldn't allocate each time.
    const bool fits = graph.arenaBytes <= arena_.size() && arena_.size() <= 2 * graph.arenaBytes;
    gpu::Buffer arena;
    if (!fits && graph.arenaBytes > 0)
        arena = device_.createBuffer(graph.arenaBytes, gpu::Memory::Device, "render graph arena");

    std::map<std::string, Halves, std::less<>> created;
    for (const ResourceInfo& resource : graph.resources) {
        if (!isKept(resource)) continue;
        const auto known = historyMemory_.find(resource.name);
        if (known != historyMemory_.end() && known->second[0].size() >= resource.bytes &&
            known->second[0].size() <= std::max<size_t>(resource.bytes, 16))
            continue;
        Halves& halves = created[resource.name];
        for (gpu::Buffer& half : halves) {
            half = device_.createBuffer(resource.bytes, gpu::Memory::Device, resource.name);
            if (resource.role == HistoryRole::Persistent) break;
        }
    }

    // Nothing below throws for want of memory on the device.
    if (!fits) arena_ = std::move(arena);
    graph_ = std::move(graph);
    std::map<std::string, Halves, std::less<>> kept;
    for (const ResourceInfo& resource : graph_.resources) {
        if (!isKept(resource)) continue;
        const auto fresh = created.find(resource.name);
        kept.emplace(resource.name,
                     std::move(fresh != created.end() ? fresh->second : historyMemory_.find(resource.name)->second));
    }
    historyMemory_ = std::move(kept);
    history_.adopt(graph_);
}

void GraphExecutor::record(gpu::Commands& commands, const FrameInput& input) {
    history_.beginFrame();
    execute(commands, input);
    history_.endFrame();
}

void GraphExecutor::rehearse(const FrameInput& input) {
    history_.reset();
    gpu::Commands nothing;
    execute(nothing, input);
}

void GraphExecutor::execute(gpu::Commands& commands, const FrameInput& input) {
    PassResources resources(graph_, graph_.resources.size());
    for (size_t i = 0; i < graph_.resources.size(); ++i) {
        const ResourceInfo& resource = graph_.resources[i];
        if (!resource.used) continue;
        const bool past = resource.role == HistoryRole::Previous || resource.role == HistoryRole::Persistent;
        const bool valid = past && history_.valid(pairName(resource));
        resources.set(i, region(resource).address(), valid);
    }
    FrameContext context{.commands = commands,
                         .resources = resources,
                         .params = input.params,
                         .facts = input.facts,
                         .frame = input.frame,
                         .width = graph_.width,
                         .height = graph_.height,
                         .sampleIndex = input.sampleIndex,
                         .repeats = input.repeats,
                         .pipeline = input.pipeline};

    // Orders this frame behind the last one, which used the same memory, and behind uploads.
    commands.barrier();
    uint32_t slot = firstTimestamp_ = input.firstTimestamp;
    commands.timestamp(slot);
    for (size_t i = 0; i < graph_.passes.size(); ++i) {
        const Pass& pass = graph_.passes[i];
        if (!pass.runs()) continue;
        if (!pass.barrierBefore.empty()) commands.barrier();
        resources.enter(pass);
        input.nodes[i].node->execute(context);
        commands.timestamp(++slot);
    }
    commands.barrier();
}

std::vector<double> GraphExecutor::passTimes(std::span<const double> timestamps) const {
    std::vector<double> times(graph_.passes.size(), 0.0);
    uint32_t slot = firstTimestamp_;
    for (size_t i = 0; i < times.size() && slot + 1 < timestamps.size(); ++i) {
        if (!graph_.passes[i].runs()) continue;
        times[i] = timestamps[slot + 1] - timestamps[slot];
        ++slot;
    }
    return times;
}

GraphExecutor::Region GraphExecutor::region(std::string_view name) const {
    const ResourceInfo* resource = graph_.find(name);
    return resource ? region(*resource) : Region{};
}

GraphExecutor::Region GraphExecutor::region(const ResourceInfo& resource) const {
    if (resource.role == HistoryRole::None) return {&arena_, resource.offset, resource.bytes};
    const std::string_view pair = pairName(resource);
    uint32_t half = history_.currentHalf(pair) ^ (resource.role == HistoryRole::Previous ? 1u : 0u);
    if (resource.role == HistoryRole::Persistent) half = 0;
    return {&historyMemory_.find(pair)->second[half], 0, resource.bytes};
}

size_t GraphExecutor::memoryBytes() const {
    size_t bytes = arena_.size();
    for (const auto& [name, halves] : historyMemory_) bytes += halves[0].size() + halves[1].size();
    return bytes;
}

} // namespace trilume::graph
