#include "render/effort_governor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trilume {
namespace {

constexpr double kRange = 4; // between effort 1 and 0 a factor of 55

/// A renderer of which `governed` ms at effort 1 follow effort^`power`, on top of `fixed` ms, with noise and hiccups.
struct Renderer {
    double fixed, governed, power = 1, noise = 0;
    int hiccupEvery = 0;
    std::minstd_rand random{7};
    int frames = 0;

    double ms(double effort) {
        const double clean = fixed + governed * std::exp(power * kRange * (effort - 1));
        const double factor = 1 + noise * std::uniform_real_distribution(-1.0, 1.0)(random);
        return clean * factor * (hiccupEvery > 0 && ++frames % hiccupEvery == 0 ? 10 : 1);
    }
};

/// Returns how often effort changed.
int run(EffortGovernor& governor, Renderer& renderer, int frames) {
    int changes = 0;
    for (int i = 0; i < frames; ++i) {
        const double before = governor.effort();
        governor.take(renderer.ms(before), kRange);
        changes += governor.effort() != before ? 1 : 0;
    }
    return changes;
}

TEST(EffortGovernor, LeavesAloneWhatIsFastEnough) {
    EffortGovernor governor(33);
    Renderer renderer{.fixed = 10, .governed = 20, .noise = 0.08, .hiccupEvery = 17};
    EXPECT_EQ(run(governor, renderer, 500), 0);
    EXPECT_EQ(governor.effort(), 1);
}

TEST(EffortGovernor, SettlesWithinTheTargetAndStays) {
    for (const double power : {1.0, 0.5, 0.2}) {
        EffortGovernor governor(33);
        Renderer renderer{.fixed = 2, .governed = 60, .power = power, .noise = 0.08, .hiccupEvery = 17};
        run(governor, renderer, 150);
        Renderer clean{.fixed = 2, .governed = 60, .power = power};
        EXPECT_LE(clean.ms(governor.effort()), 33 * 1.08) << power;
        EXPECT_GE(clean.ms(governor.effort()), 33 * 0.72) << power;
        EXPECT_LE(run(governor, renderer, 600), 3) << "it swings; power " << power;
    }
}

TEST(EffortGovernor, FollowsAChangeOfLoadBothWaysFromOneSide) {
    EffortGovernor governor(20);
    Renderer heavy{.fixed = 5, .governed = 100}, light{.fixed = 5, .governed = 10};
    double last = 1;
    for (int i = 0; i < 90; ++i) {
        run(governor, heavy, 1);
        EXPECT_LE(governor.effort(), last) << "down only";
        last = governor.effort();
    }
    EXPECT_LE(heavy.ms(last), 20);
    for (int i = 0; i < 90; ++i) {
        run(governor, light, 1);
        EXPECT_GE(governor.effort(), last) << "up only";
        last = governor.effort();
    }
    EXPECT_EQ(last, 1);
}

TEST(EffortGovernor, EndsAtNoEffortWhereNothingHelps) {
    EffortGovernor governor(5);
    Renderer renderer{.fixed = 10, .governed = 10};
    run(governor, renderer, 300);
    EXPECT_EQ(governor.effort(), 0);
}

TEST(EffortGovernor, IgnoresTimesThatAreNone) {
    EffortGovernor governor(5);
    for (int i = 0; i < 9; ++i) governor.take(i % 2 ? 0 : std::nan(""), kRange);
    for (int i = 0; i < 9; ++i) governor.take(100, 0);
    EXPECT_EQ(governor.effort(), 1);
}

} // namespace
} // namespace trilume
