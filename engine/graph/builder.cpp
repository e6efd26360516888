#include "graph/builder.h"

#include <fmt/core.h>

#include <algorithm>

namespace trilume::graph {

namespace {

template<class H>
constexpr ResourceKind kindOf = std::is_same_v<H, Plane> ? ResourceKind::Plane : ResourceKind::Buffer;

} // namespace

Recorder::Recorder(const CompileInput& input, const std::vector<Pass>& passes)
    : input_(input), passes_(passes), declarations_(passes.size()) {}

void Recorder::declare(uint32_t pass, Node& node) {
    pass_ = pass;
    node.declare(*this);
}

void Recorder::throwErrors() const {
    if (errors_.empty()) return;
    const Error& first = errors_.begin()->second;
    const bool input = std::all_of(errors_.begin(), errors_.end(),
                                   [](const auto& entry) { return entry.second.fault() == Fault::Input; });
    std::string hint = first.hint();
    for (auto it = std::next(errors_.begin()); it != errors_.end(); ++it)
        hint += fmt::format("; also {}: {}", it->second.where(), it->second.problem());
    throw Error(input ? Fault::Input : Fault::Run, first.problem(), first.where(), hint);
}

std::optional<uint32_t> Recorder::find(std::string_view name) const {
    const auto it = byName_.find(name);
    return it == byName_.end() ? std::nullopt : std::optional(it->second);
}

std::string Recorder::whyMissing(std::string_view name) const {
    const std::string_view maker = name.substr(0, name.find('.'));
    const auto pass = std::find_if(passes_.begin(), passes_.end(), [&](const Pass& p) { return p.name == maker; });
    if (pass == passes_.end()) return "no node makes it";
    switch (pass->state) {
    case PassState::Disabled:
        return fmt::format("{} is disabled", maker);
    case PassState::NotNeeded:
        return fmt::format("{} is not needed: {}", maker, pass->reason);
    default:
        return fmt::format("{} has not made it so far", maker);
    }
}

Plane Recorder::createPlane(std::string_view name, uint32_t bytesPerPixel) {
    return create<Plane>({.name = std::string(name),
                          .kind = ResourceKind::Plane,
                          .bytes = planeBytes(bytesPerPixel),
                          .bytesPerPixel = bytesPerPixel});
}

Buffer Recorder::createBuffer(std::string_view name, size_t bytes) {
    return create<Buffer>({.name = std::string(name), .kind = ResourceKind::Buffer, .bytes = bytes});
}

History<Plane> Recorder::historyPlane(std::string_view name, uint32_t bytesPerPixel) {
    return createHistory<Plane>({.name = std::string(name),
                                 .kind = ResourceKind::Plane,
                                 .bytes = planeBytes(bytesPerPixel),
                                 .bytesPerPixel = bytesPerPixel});
}

History<Buffer> Recorder::historyBuffer(std::string_view name, size_t bytes) {
    return createHistory<Buffer>({.name = std::string(name), .kind = ResourceKind::Buffer, .bytes = bytes});
}

Buffer Recorder::persistentBuffer(std::string_view name, size_t bytes) {
    return create<Buffer>(
        {.name = std::string(name), .kind = ResourceKind::Buffer, .role = HistoryRole::Persistent, .bytes = bytes});
}

template<class H>
H Recorder::create(ResourceInfo info) {
    const auto index = static_cast<uint32_t>(resources_.size());
    if (const auto [it, isNew] = byName_.try_emplace(info.name, index); !isNew) {
        fail(Fault::Run, "creates a resource that exists", info.name,
             fmt::format("{} made it first: choose another name or write to that one",
                         passes_[producers_[it->second].front()].name));
        return {};
    }
    const bool writes = info.role != HistoryRole::Previous;
    resources_.push_back(std::move(info));
    producers_.push_back({pass_});
    declarations_[pass_].accesses.push_back(
        {.resource = index, .before = 0, .after = 1, .reads = !writes, .writes = writes});
    return {index, 1};
}

template<class H>
History<H> Recorder::createHistory(const ResourceInfo& info) {
    ResourceInfo current = info, previous = info;
    current.role = HistoryRole::Current;
    previous.role = HistoryRole::Previous;
    previous.name += ".previous";
    History<H> history;
    history.current = create<H>(std::move(current));
    if (history.current) history.previous = create<H>(std::move(previous));
    return history;
}

template<class H>
H Recorder::findHandle(std::string_view name) const {
    const auto index = find(name);
    if (index && resources_[*index].kind == kindOf<H>) return {*index, latest(*index)};
    declarations_[pass_].missing.emplace_back(name);
    return {};
}

Plane Recorder::findPlane(std::string_view name) const { return findHandle<Plane>(name); }
Buffer Recorder::findBuffer(std::string_view name) const { return findHandle<Buffer>(name); }

std::vector<Plane> Recorder::findPlanes(std::string_view suffix) const {
    std::vector<Plane> planes;
    for (uint32_t i = 0; i < resources_.size(); ++i)
        if (resources_[i].kind == ResourceKind::Plane && resources_[i].name.ends_with(suffix))
            planes.push_back({i, latest(i)});
    return planes;
}

const std::string& Recorder::nameOf(Plane plane) const { return resources_.at(plane.resource).name; }

template<class H>
bool Recorder::check(H handle, std::string_view verb) {
    const std::vector<std::string>& missing = declarations_[pass_].missing;
    if (!handle && !missing.empty()) {
        const std::string& name = missing.back();
        const auto found = find(name);
        const std::string why =
            found ? fmt::format("it is a {}", kindOf<H> == ResourceKind::Plane ? "buffer" : "plane") : whyMissing(name);
        const bool userDisabled = std::any_of(passes_.begin(), passes_.end(), [&](const Pass& p) {
            return p.state == PassState::Disabled && p.name == name.substr(0, name.find('.'));
        });
        fail(userDisabled ? Fault::Input : Fault::Run, fmt::format("{} a resource that nobody wrote", verb), name, why);
        return false;
    }
    if (handle.resource >= resources_.size() || handle.version == 0 || handle.version > latest(handle.resource) ||
        resources_[handle.resource].kind != kindOf<H>) {
        fail(Fault::Run, fmt::format("{} an unknown handle", verb),
             handle ? "a handle of another graph" : "null handle",
             "take handles from create or find in the same declare");
        return false;
    }
    if (handle.version != latest(handle.resource)) {
        fail(Fault::Run, fmt::format("{} a retired version", verb), resources_[handle.resource].name,
             fmt::format("{} has written it since: use the handle that its write gave, or find it again",
                         passes_[lastProducer(handle.resource)].name));
        return false;
    }
    return true;
}

VersionedAccess& Recorder::access(uint32_t resource) {
    std::vector<VersionedAccess>& accesses = declarations_[pass_].accesses;
    const auto it = std::find_if(accesses.begin(), accesses.end(),
                                 [&](const VersionedAccess& a) { return a.resource == resource; });
    if (it != accesses.end()) return *it;
    const uint32_t version = latest(resource);
    return accesses.emplace_back(VersionedAccess{.resource = resource, .before = version, .after = version});
}

template<class H>
void Recorder::recordRead(H handle) {
    if (check(handle, "reads")) access(handle.resource).reads = true;
}

template<class H>
H Recorder::recordWrite(H handle) {
    if (!check(handle, "writes")) return {};
    if (resources_[handle.resource].role == HistoryRole::Previous) {
        fail(Fault::Run, "writes last frame's half of a history pair", resources_[handle.resource].name,
             "write the current half");
        return {};
    }
    VersionedAccess& written = access(handle.resource);
    written.writes = true;
    producers_[handle.resource].push_back(pass_);
    written.after = latest(handle.resource);
    return {handle.resource, written.after};
}

void Recorder::owns(PathClass pathClass) { declarations_[pass_].owned.push_back(pathClass); }
void Recorder::sideEffect() { declarations_[pass_].sideEffect = true; }

void Recorder::fail(Fault fault, std::string_view problem, std::string_view resource, std::string_view hint) {
    errors_.try_emplace(pass_, fault, fmt::format("the node {}", problem),
                        fmt::format("{}, {}", passes_[pass_].name, resource), std::string(hint));
}

} // namespace trilume::graph
