#include "core/task_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

namespace trilume {
namespace {

class TaskPoolTest : public testing::TestWithParam<unsigned> {
protected:
    TaskPool pool{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Threads, TaskPoolTest, testing::Values(1u, 2u, 7u));

TEST_P(TaskPoolTest, CountsTheCaller) { EXPECT_EQ(pool.threadCount(), GetParam()); }

TEST_P(TaskPoolTest, VisitsEveryIndexOnceInChunksOfAtMostTheGrain) {
    std::vector<std::atomic<int>> visits(10'007);
    pool.parallelFor(visits.size(), 64, [&](size_t begin, size_t end) {
        EXPECT_LT(begin, end);
        EXPECT_LE(end - begin, 64u);
        for (size_t i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& v : visits) ASSERT_EQ(v, 1);
}

TEST_P(TaskPoolTest, NothingToDoCallsNothing) {
    pool.parallelFor(0, 8, [](size_t, size_t) { FAIL(); });
}

TEST_P(TaskPoolTest, NestedLoopsMakeProgress) {
    std::atomic<int> sum = 0;
    pool.parallelFor(16, 1, [&](size_t, size_t) {
        pool.parallelFor(16, 1, [&](size_t, size_t) { pool.parallelFor(16, 1, [&](size_t, size_t) { ++sum; }); });
    });
    EXPECT_EQ(sum, 16 * 16 * 16);
}

uint64_t fibonacci(TaskPool& pool, unsigned n) {
    if (n < 2) return n;
    uint64_t a = 0, b = 0;
    pool.invoke([&] { a = fibonacci(pool, n - 1); }, [&] { b = fibonacci(pool, n - 2); });
    return a + b;
}

TEST_P(TaskPoolTest, RecursiveInvoke) { EXPECT_EQ(fibonacci(pool, 16), 987u); }

TEST_P(TaskPoolTest, FirstExceptionComesOutAfterStartedChunksEnded) {
    std::atomic<int> inside = 0;
    const auto failing = [&] {
        pool.parallelFor(1000, 1, [&](size_t begin, size_t) {
            ++inside;
            std::this_thread::sleep_for(std::chrono::microseconds(50));
            --inside;
            if (begin == 3) throw std::runtime_error("three");
        });
    };
    EXPECT_THROW(failing(), std::runtime_error);
    EXPECT_EQ(inside, 0);
    // And the pool still works.
    EXPECT_EQ(fibonacci(pool, 10), 55u);
}

TEST_P(TaskPoolTest, CallersFromManyThreadsShareOnePool) {
    std::vector<uint64_t> results(4);
    std::vector<std::thread> callers;
    for (uint64_t& result : results) callers.emplace_back([&] { result = fibonacci(pool, 12); });
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(results, std::vector<uint64_t>(4, 144));
}

TEST(TaskPool, TwoThreadsRunAtOnce) {
    TaskPool pool(2);
    std::atomic<bool> a = false, b = false;
    // Each waits for the other: with one thread alone this would never end (ctest's time limit would).
    pool.invoke(
        [&] {
            a = true;
            while (!b) std::this_thread::yield();
        },
        [&] {
            b = true;
            while (!a) std::this_thread::yield();
        });
    EXPECT_TRUE(a && b);
}

TEST(TaskPool, EnvironmentSetsTheThreads) {
    ::setenv("TRILUME_THREADS", "3", 1);
    EXPECT_EQ(TaskPool().threadCount(), 3u);
    ::setenv("TRILUME_THREADS", "many", 1);
    EXPECT_GE(TaskPool().threadCount(), 1u);
    ::unsetenv("TRILUME_THREADS");
}

} // namespace
} // namespace trilume
