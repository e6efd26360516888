#pragma once

#include <cassert>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <typeindex>
#include <unordered_map>
#include <utility>
#include <vector>

namespace trilume {

/// A handle with a generation: a destroyed entity's handle never becomes valid again.
struct Entity {
    static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
    uint32_t index = kNone;
    uint32_t generation = 0;
    explicit operator bool() const { return index != kNone; }
    friend bool operator==(Entity, Entity) = default;
};

/// A point in the world's history. A reader that last looked at tick t asks for what changed after t.
using Tick = uint64_t;

/// Type-erased part of a component's storage: what the world needs to destroy an entity.
class ComponentPoolBase {
public:
    virtual ~ComponentPoolBase() = default;
    virtual bool erase(Entity entity, Tick now) = 0;
};

/// Sparse set of one component type: dense values, owners and change ticks, and on demand a log of removals.
template<class C>
class ComponentPool final : public ComponentPoolBase {
public:
    struct Removal {
        Entity entity;
        Tick tick;
    };

    C* find(Entity entity) {
        const uint32_t slot = slotOf(entity);
        return slot == Entity::kNone ? nullptr : &values_[slot];
    }
    C& put(Entity entity, C value, Tick now) {
        if (const uint32_t slot = slotOf(entity); slot != Entity::kNone) {
            values_[slot] = std::move(value);
            changed_[slot] = now;
            return values_[slot];
        }
        if (entity.index >= sparse_.size()) sparse_.resize(entity.index + 1, Entity::kNone);
        sparse_[entity.index] = static_cast<uint32_t>(values_.size());
        ++turnover_;
        values_.push_back(std::move(value));
        owners_.push_back(entity);
        changed_.push_back(now);
        return values_.back();
    }
    void touch(Entity entity, Tick now) { changed_[slotOf(entity)] = now; }
    bool erase(Entity entity, Tick now) override {
        const uint32_t slot = slotOf(entity);
        if (slot == Entity::kNone) return false;
        ++turnover_;
        sparse_[owners_.back().index] = slot;
        sparse_[entity.index] = Entity::kNone;
        values_[slot] = std::move(values_.back());
        owners_[slot] = owners_.back();
        changed_[slot] = changed_.back();
        values_.pop_back();
        owners_.pop_back();
        changed_.pop_back();
        if (followed_) removals_.push_back({entity, now});
        return true;
    }
    void followRemovals() { followed_ = true; }
    /// Forgets removals up to `tick`, once every reader has seen them.
    void trimRemovals(Tick tick) {
        std::erase_if(removals_, [tick](const Removal& r) { return r.tick <= tick; });
    }

    std::span<C> values() { return values_; }
    std::span<const Entity> owners() const { return owners_; }
    std::span<const Tick> changed() const { return changed_; }
    std::span<const Removal> removals() const { return removals_; }
    uint64_t turnover() const { return turnover_; }

private:
    uint32_t slotOf(Entity entity) const {
        if (entity.index >= sparse_.size()) return Entity::kNone;
        const uint32_t slot = sparse_[entity.index];
        return slot != Entity::kNone && owners_[slot] == entity ? slot : Entity::kNone;
    }

    std::vector<uint32_t> sparse_;
    std::vector<C> values_;
    std::vector<Entity> owners_;
    std::vector<Tick> changed_;
    std::vector<Removal> removals_;
    uint64_t turnover_ = 0;
    bool followed_ = false;
};

/// Entities and their components. Not thread-safe. References to components hold until the next add or remove of
/// that type.
class World {
public:
    Entity create();
    /// Removes the entity and its components; false when it was not alive.
    bool destroy(Entity entity);
    bool alive(Entity entity) const;
    size_t size() const { return generations_.size() - free_.size(); }

    /// Adds or replaces; counts as a change.
    template<class C>
    C& add(Entity entity, C component = {}) {
        assert(alive(entity));
        return pool<C>().put(entity, std::move(component), ++tick_);
    }
    template<class C>
    const C* find(Entity entity) const {
        return const_cast<World*>(this)->pool<C>().find(entity);
    }
    /// The component for writing; counts as a change. Null when the entity has none.
    template<class C>
    C* modify(Entity entity) {
        auto& p = pool<C>();
        C* c = p.find(entity);
        if (c) p.touch(entity, ++tick_);
        return c;
    }
    /// Writes only when the value differs: equal writes are not changes. Adds when absent.
    template<class C>
    bool assign(Entity entity, C component) {
        const C* old = find<C>(entity);
        if (old && *old == component) return false;
        add<C>(entity, std::move(component));
        return true;
    }
    template<class C>
    bool remove(Entity entity) {
        return pool<C>().erase(entity, ++tick_);
    }

    /// The current point in history: remember it, then ask for what changed after it.
    Tick now() const { return tick_; }

    /// Calls f(Entity, const C&) for each.
    template<class C, class F>
    void each(F&& f) const {
        auto& p = const_cast<World*>(this)->pool<C>();
        for (size_t i = 0; i < p.owners().size(); ++i) f(p.owners()[i], std::as_const(p.values()[i]));
    }
    /// Calls f(Entity, const C&) for each component added or changed after `since`.
    template<class C, class F>
    void eachChanged(Tick since, F&& f) const {
        auto& p = const_cast<World*>(this)->pool<C>();
        for (size_t i = 0; i < p.owners().size(); ++i)
            if (p.changed()[i] > since) f(p.owners()[i], std::as_const(p.values()[i]));
    }
    /// Keeps a log of the removals of C from now on; whoever reads it trims it, or it grows.
    template<class C>
    void followRemovals() {
        pool<C>().followRemovals();
    }
    /// Calls f(Entity) for each removal of C after `since` and followRemovals; the entity may have died since.
    template<class C, class F>
    void eachRemoved(Tick since, F&& f) const {
        for (const auto& r : const_cast<World*>(this)->pool<C>().removals())
            if (r.tick > since) f(r.entity);
    }
    template<class C>
    size_t count() const {
        return const_cast<World*>(this)->pool<C>().owners().size();
    }
    /// How many components of the type were added or removed so far: while it stays, the same entities have one.
    template<class C>
    uint64_t turnover() const {
        return const_cast<World*>(this)->pool<C>().turnover();
    }
    template<class C>
    void trimRemovals(Tick tick) {
        pool<C>().trimRemovals(tick);
    }

private:
    template<class C>
    ComponentPool<C>& pool() {
        auto& slot = pools_[std::type_index(typeid(C))];
        if (!slot) slot = std::make_unique<ComponentPool<C>>();
        return static_cast<ComponentPool<C>&>(*slot);
    }

    std::vector<uint32_t> generations_;
    std::vector<uint32_t> free_;
    std::unordered_map<std::type_index, std::unique_ptr<ComponentPoolBase>> pools_;
    Tick tick_ = 0;
};

} // namespace trilume
