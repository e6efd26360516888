#include "core/task_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace trilume {
namespace {

using Body = std::function<void(size_t, size_t)>;

/// One parallelFor under way; lives on its caller's stack until every helper has left.
struct Job {
    const size_t count, grain;
    const Body& body;
    uint64_t order = 0;   ///< of opening; guarded by the pool's mutex, as all that follows
    unsigned helpers = 0; ///< threads inside, beside the caller
    std::exception_ptr error;
    std::atomic<size_t> next{0}; ///< first index not handed out; not guarded

    bool exhausted() const { return next.load(std::memory_order_relaxed) >= count; }
    void work() {
        for (;;) {
            const size_t begin = next.fetch_add(grain, std::memory_order_relaxed);
            if (begin >= count) return;
            body(begin, std::min(begin + grain, count));
        }
    }
};

unsigned defaultThreadCount() {
    if (const char* text = std::getenv("TRILUME_THREADS"))
        if (const long threads = std::strtol(text, nullptr, 10); threads > 0)
            return static_cast<unsigned>(std::min(threads, 1024l));
    return std::max(1u, std::thread::hardware_concurrency());
}

} // namespace

struct TaskPool::Impl {
    std::mutex mutex;
    std::condition_variable wake; ///< a job opened, a helper left, or the pool stops
    std::vector<Job*> open;       ///< jobs that may have chunks to hand out, oldest first
    std::vector<std::thread> workers;
    uint64_t opened = 0;
    bool stop = false;

    void runGuarded(Job& job) {
        try {
            job.work();
        } catch (...) {
            job.next = job.count; // Chunks not yet started are dropped.
            const std::scoped_lock lock(mutex);
            if (!job.error) job.error = std::current_exception();
        }
    }

    /// Helps the newest job opened after `order`; false when there is none. Waiters pass their own job's order: what is
    /// newer may be what they wait for, and the depth of their stack stays that of the nesting.
    bool helpNewest(std::unique_lock<std::mutex>& lock, uint64_t order) {
        std::erase_if(open, [](const Job* job) { return job->exhausted(); });
        if (open.empty() || open.back()->order <= order) return false;
        Job& job = *open.back();
        ++job.helpers;
        lock.unlock();
        runGuarded(job);
        lock.lock();
        if (--job.helpers == 0) wake.notify_all();
        return true;
    }

    void workerLoop() {
        std::unique_lock lock(mutex);
        while (!stop)
            if (!helpNewest(lock, 0)) wake.wait(lock);
    }

    void run(Job& job) {
        {
            const std::scoped_lock lock(mutex);
            job.order = ++opened;
            open.push_back(&job);
        }
        wake.notify_all();
        runGuarded(job);
        std::unique_lock lock(mutex);
        std::erase(open, &job);
        while (job.helpers > 0)
            if (!helpNewest(lock, job.order)) wake.wait(lock);
    }
};

TaskPool::TaskPool(unsigned threads) : impl_(std::make_unique<Impl>()) {
    if (threads == 0) threads = defaultThreadCount();
    impl_->workers.reserve(threads - 1);
    for (unsigned i = 1; i < threads; ++i) impl_->workers.emplace_back([this] { impl_->workerLoop(); });
}

TaskPool::~TaskPool() {
    {
        const std::scoped_lock lock(impl_->mutex);
        impl_->stop = true;
    }
    impl_->wake.notify_all();
    for (std::thread& worker : impl_->workers) worker.join();
}

unsigned TaskPool::threadCount() const { return static_cast<unsigned>(impl_->workers.size()) + 1; }

void TaskPool::parallelFor(size_t count, size_t grain, const Body& body) {
    Job job{.count = count, .grain = std::max<size_t>(grain, 1), .body = body};
    if (impl_->workers.empty() || count <= job.grain) return job.work();
    impl_->run(job);
    if (job.error) std::rethrow_exception(job.error);
}

void TaskPool::invoke(const std::function<void()>& a, const std::function<void()>& b) {
    parallelFor(2, 1, [&](size_t begin, size_t) { begin == 0 ? a() : b(); });
}

TaskPool& TaskPool::shared() {
    static TaskPool pool;
    return pool;
}

} // namespace trilume
