#include "ecs/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>

namespace trilume {
namespace {

struct Health {
    int points = 0;
    bool operator==(const Health&) const = default;
};
struct Label {
    std::string text;
};

template<class C>
std::vector<Entity> changedSince(const World& world, Tick since) {
    std::vector<Entity> entities;
    world.eachChanged<C>(since, [&](Entity e, const C&) { entities.push_back(e); });
    return entities;
}

template<class C>
std::vector<Entity> removedSince(const World& world, Tick since) {
    std::vector<Entity> entities;
    world.eachRemoved<C>(since, [&](Entity e) { entities.push_back(e); });
    return entities;
}

TEST(World, DeadHandlesStayDead) {
    World world;
    const Entity first = world.create();
    world.add(first, Health{1});
    EXPECT_TRUE(world.destroy(first));
    EXPECT_FALSE(world.destroy(first));
    const Entity second = world.create();
    EXPECT_EQ(second.index, first.index);
    EXPECT_NE(second, first);
    EXPECT_FALSE(world.alive(first));
    EXPECT_TRUE(world.alive(second));
    EXPECT_EQ(world.find<Health>(first), nullptr);
    EXPECT_EQ(world.find<Health>(second), nullptr);
    world.add(second, Health{2});
    EXPECT_EQ(world.find<Health>(first), nullptr);
    EXPECT_FALSE(world.remove<Health>(first));
    EXPECT_FALSE(world.alive(Entity{}));
    EXPECT_EQ(world.size(), 1u);
}

TEST(World, ChangesAreSeenOnce) {
    World world;
    const Entity a = world.create(), b = world.create();
    world.add(a, Health{1});
    world.add(b, Health{2});
    Tick seen = world.now();
    EXPECT_TRUE(changedSince<Health>(world, seen).empty());

    world.modify<Health>(b)->points = 3;
    EXPECT_EQ(changedSince<Health>(world, seen), std::vector{b});
    seen = world.now();

    EXPECT_FALSE(world.assign(b, Health{3})) << "an equal write is no change";
    EXPECT_TRUE(changedSince<Health>(world, seen).empty());
    EXPECT_TRUE(world.assign(a, Health{9}));
    EXPECT_EQ(changedSince<Health>(world, seen), std::vector{a});
    EXPECT_EQ(world.modify<Label>(a), nullptr);
}

TEST(World, RemovalsAreSeenUntilTrimmed) {
    World world;
    world.followRemovals<Health>();
    const Entity a = world.create(), b = world.create();
    for (const Entity e : {a, b}) {
        world.add(e, Health{});
        world.add(e, Label{"x"});
    }
    const Tick start = world.now();
    world.remove<Health>(a);
    const Tick middle = world.now();
    world.destroy(b);
    EXPECT_EQ(removedSince<Health>(world, start), (std::vector{a, b}));
    EXPECT_EQ(removedSince<Health>(world, middle), std::vector{b});
    EXPECT_TRUE(removedSince<Label>(world, start).empty()) << "nobody asked for these";
    world.trimRemovals<Health>(middle);
    EXPECT_EQ(removedSince<Health>(world, start), std::vector{b});
}

/// Erasing swaps the last value in: values, owners and ticks must stay together.
TEST(World, AgreesWithAMapUnderRandomEdits) {
    World world;
    std::map<uint32_t, int> expected;
    std::vector<Entity> entities;
    for (int i = 0; i < 64; ++i) entities.push_back(world.create());
    std::mt19937 random(7);
    for (int step = 0; step < 5000; ++step) {
        const Entity e = entities[random() % entities.size()];
        const Tick before = world.now();
        const uint64_t turnover = world.turnover<Health>();
        if (random() % 3 == 0) {
            const bool had = expected.erase(e.index) == 1;
            EXPECT_EQ(world.remove<Health>(e), had);
            EXPECT_EQ(world.turnover<Health>() - turnover, had ? 1u : 0u);
        } else {
            world.add(e, Health{step});
            EXPECT_EQ(world.turnover<Health>() - turnover, expected.contains(e.index) ? 0u : 1u);
            expected[e.index] = step;
            ASSERT_EQ(changedSince<Health>(world, before), std::vector{e});
        }
        ASSERT_EQ(world.count<Health>(), expected.size());
    }
    size_t visited = 0;
    world.each<Health>([&](Entity e, const Health& h) {
        EXPECT_EQ(expected.at(e.index), h.points);
        EXPECT_EQ(world.find<Health>(e), &h);
        ++visited;
    });
    EXPECT_EQ(visited, expected.size());
}

} // namespace
} // namespace trilume
