#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace trilume {

/// A fixed set of worker threads. The calling thread works too, so nested calls make progress and never deadlock.
class TaskPool {
public:
    /// `threads` counts the caller; 0 takes TRILUME_THREADS, else one per hardware thread.
    explicit TaskPool(unsigned threads = 0);
    ~TaskPool();
    TaskPool(const TaskPool&) = delete;
    TaskPool& operator=(const TaskPool&) = delete;

    unsigned threadCount() const;

    /// Calls `body(begin, end)` over [0, count) in chunks of at most `grain`; returns when all are done.
    /// The first exception thrown by a chunk is rethrown here, after every started chunk has ended.
    void parallelFor(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body);

    /// Runs both, in parallel when a worker is free.
    void invoke(const std::function<void()>& a, const std::function<void()>& b);

    /// The process's shared pool.
    static TaskPool& shared();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace trilume
