#include "scene/hierarchy.h"

#include "core/log.h"

#include <utility>

namespace trilume {

size_t Hierarchy::update(World& world) {
    ++updates_;
    dirty_.clear();
    settleMotion(world);
    collectRemovals(world);
    collectChanges(world);

    size_t visited = 0;
    for (const Entity entity : dirty_) {
        // Below another dirty entity: that one's visit comes by here.
        uint32_t above = nodes_[entity.index].parent;
        while (above != Entity::kNone && nodes_[above].dirtyAt != updates_) above = nodes_[above].parent;
        if (above == Entity::kNone) visited += visitSubtree(world, entity.index);
    }
    seen_ = world.now();
    return visited;
}

/// An index may come back with another generation: what hung on the old entity must not hang on the new one.
Hierarchy::Node& Hierarchy::node(Entity entity) {
    if (entity.index >= nodes_.size()) nodes_.resize(entity.index + 1);
    if (nodes_[entity.index].self != entity) {
        unlink(entity.index);
        orphanChildren(entity.index);
        nodes_[entity.index].self = entity;
    }
    return nodes_[entity.index];
}

void Hierarchy::markDirty(Entity entity) {
    Node& n = node(entity);
    if (n.dirtyAt == updates_) return;
    n.dirtyAt = updates_;
    dirty_.push_back(entity);
}

void Hierarchy::unlink(uint32_t index) {
    Node& n = nodes_[index];
    if (n.parent == Entity::kNone) return;
    (n.previousSibling == Entity::kNone ? nodes_[n.parent].firstChild : nodes_[n.previousSibling].nextSibling) =
        n.nextSibling;
    if (n.nextSibling != Entity::kNone) nodes_[n.nextSibling].previousSibling = n.previousSibling;
    n.parent = n.previousSibling = n.nextSibling = Entity::kNone;
}

void Hierarchy::orphanChildren(uint32_t index) {
    while (nodes_[index].firstChild != Entity::kNone) {
        const uint32_t child = nodes_[index].firstChild;
        unlink(child);
        markDirty(nodes_[child].self);
    }
}

bool Hierarchy::isAncestor(uint32_t ancestor, uint32_t index) const {
    if (ancestor == index) return true;
    // Most links are of new entities, without children: no need to walk up, which makes deep chains cost O(depth) in
    // all.
    if (nodes_[ancestor].firstChild == Entity::kNone) return false;
    while (index != Entity::kNone && index != ancestor) index = nodes_[index].parent;
    return index == ancestor;
}

void Hierarchy::link(const World& world, Entity child, Entity parent) {
    if (!parent || !world.alive(parent)) return;
    node(parent); // May grow nodes_, so before any reference into it.
    if (isAncestor(child.index, parent.index)) {
        const Name* name = world.find<Name>(child);
        log::warning("parent ignored: {}: it is its own ancestor; correct the hierarchy",
                     name ? name->path : "(unnamed)");
        return;
    }
    Node& n = nodes_[child.index];
    n.parent = parent.index;
    n.nextSibling = std::exchange(nodes_[parent.index].firstChild, child.index);
    if (n.nextSibling != Entity::kNone) nodes_[n.nextSibling].previousSibling = child.index;
}

void Hierarchy::collectRemovals(World& world) {
    const auto forget = [&](Entity entity) {
        Node& n = node(entity);
        unlink(entity.index);
        if (world.alive(entity)) return markDirty(entity);
        orphanChildren(entity.index);
        n.self = {};
    };
    world.followRemovals<Parent>();
    world.followRemovals<LocalTransform>();
    world.followRemovals<Visibility>();
    world.eachRemoved<Parent>(seen_, forget);
    world.eachRemoved<LocalTransform>(seen_, [&](Entity entity) {
        if (world.alive(entity)) {
            world.remove<WorldTransform>(entity);
            world.remove<InheritedVisibility>(entity);
            markDirty(entity);
        } else {
            forget(entity);
        }
    });
    world.eachRemoved<Visibility>(seen_, [&](Entity entity) {
        if (world.alive(entity)) markDirty(entity);
    });
    // Only this reader follows the removals of its inputs, so their logs end here.
    world.trimRemovals<Parent>(world.now());
    world.trimRemovals<LocalTransform>(world.now());
    world.trimRemovals<Visibility>(world.now());
}

void Hierarchy::collectChanges(const World& world) {
    world.eachChanged<LocalTransform>(seen_, [&](Entity entity, const LocalTransform&) { markDirty(entity); });
    world.eachChanged<Visibility>(seen_, [&](Entity entity, const Visibility&) { markDirty(entity); });
    // All old links go before the first new one comes, or swapping parent and child would look like a loop.
    world.eachChanged<Parent>(seen_, [&](Entity entity, const Parent&) {
        markDirty(entity);
        unlink(entity.index);
    });
    world.eachChanged<Parent>(seen_, [&](Entity entity, const Parent& parent) { link(world, entity, parent.entity); });
}

size_t Hierarchy::visitSubtree(World& world, uint32_t root) {
    size_t visited = 0;
    for (uint32_t at = root;;) {
        derive(world, nodes_[at]);
        ++visited;
        if (nodes_[at].firstChild != Entity::kNone) {
            at = nodes_[at].firstChild;
            continue;
        }
        while (at != root && nodes_[at].nextSibling == Entity::kNone) at = nodes_[at].parent;
        if (at == root) return visited;
        at = nodes_[at].nextSibling;
    }
}

/// The parent was derived before. An entity without LocalTransform between two that have one adds nothing of its own.
void Hierarchy::derive(World& world, const Node& n) {
    const LocalTransform* local = world.find<LocalTransform>(n.self);
    if (!local) return;

    glm::dmat4 worldFromLocal = local->parentFromLocal;
    InheritedVisibility visibility;
    if (const Visibility* own = world.find<Visibility>(n.self)) visibility = {own->visible, own->camera, own->shadow};
    uint32_t above = n.parent;
    while (above != Entity::kNone && !world.find<WorldTransform>(nodes_[above].self)) above = nodes_[above].parent;
    if (above != Entity::kNone) {
        const Entity parent = nodes_[above].self;
        worldFromLocal = world.find<WorldTransform>(parent)->worldFromLocal * worldFromLocal;
        const InheritedVisibility& inherited = *world.find<InheritedVisibility>(parent);
        visibility.visible &= inherited.visible;
        visibility.camera &= inherited.camera;
        visibility.shadow &= inherited.shadow;
    }
    world.assign(n.self, visibility);

    const WorldTransform* old = world.find<WorldTransform>(n.self);
    if (!old) {
        world.add(n.self, WorldTransform{worldFromLocal, worldFromLocal});
    } else if (old->worldFromLocal != worldFromLocal) {
        world.add(n.self, WorldTransform{worldFromLocal, old->worldFromLocal});
        moving_.push_back(n.self);
    }
}

void Hierarchy::settleMotion(World& world) {
    for (const Entity entity : std::exchange(moving_, {}))
        if (WorldTransform* transform = world.modify<WorldTransform>(entity))
            transform->previousWorldFromLocal = transform->worldFromLocal;
}

} // namespace trilume
