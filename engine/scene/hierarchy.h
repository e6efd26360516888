#pragma once

#include "ecs/world.h"
#include "scene/components.h"

#include <cstdint>
#include <vector>

namespace trilume {

/// Who is whose child, and what derives from it: WorldTransform and InheritedVisibility of every entity that has a
/// LocalTransform. Follows changes of Parent, LocalTransform and Visibility; never visits what none of them touched.
class Hierarchy {
public:
    /// Brings derived components up to date with the world. A second call without changes only lets motion come to
    /// rest. A parent link that would close a loop is ignored with a warning; children of a destroyed parent become
    /// roots. Returns the number of entities visited.
    size_t update(World& world);

private:
    /// Links form a forest at all times. Siblings are a doubly linked list, so relinking costs O(1).
    struct Node {
        Entity self;
        uint32_t parent = Entity::kNone, firstChild = Entity::kNone;
        uint32_t previousSibling = Entity::kNone, nextSibling = Entity::kNone;
        uint64_t dirtyAt = 0; ///< the update that has to visit it
    };

    Node& node(Entity entity);
    void markDirty(Entity entity);
    void unlink(uint32_t index);
    void orphanChildren(uint32_t index);
    bool isAncestor(uint32_t ancestor, uint32_t index) const;
    void link(const World& world, Entity child, Entity parent);
    void collectRemovals(World& world);
    void collectChanges(const World& world);
    size_t visitSubtree(World& world, uint32_t root);
    void derive(World& world, const Node& node);
    void settleMotion(World& world);

    std::vector<Node> nodes_; ///< by entity index
    std::vector<Entity> dirty_;
    std::vector<Entity> moving_; ///< whose previousWorldFromLocal differs from worldFromLocal
    uint64_t updates_ = 0;
    Tick seen_ = 0;
};

} // namespace trilume
