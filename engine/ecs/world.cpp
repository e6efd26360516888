#include "ecs/world.h"

namespace trilume {

Entity World::create() {
    ++tick_;
    if (free_.empty()) {
        generations_.push_back(0);
        return {static_cast<uint32_t>(generations_.size() - 1), 0};
    }
    const uint32_t index = free_.back();
    free_.pop_back();
    return {index, generations_[index]};
}

bool World::destroy(Entity entity) {
    if (!alive(entity)) return false;
    ++tick_;
    for (auto& [type, pool] : pools_) pool->erase(entity, tick_);
    ++generations_[entity.index]; // Dead from now on: no living entity has this index until create hands it out again.
    free_.push_back(entity.index);
    return true;
}

bool World::alive(Entity entity) const {
    return entity.index < generations_.size() && generations_[entity.index] == entity.generation;
}

} // namespace trilume
