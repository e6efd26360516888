#pragma once

#include <chrono>
#include <ctime>

namespace trilume {

/// Monotonic wall time, in milliseconds, since construction or the last restart.
class Stopwatch {
public:
    Stopwatch() : start_(std::chrono::steady_clock::now()) {}
    double ms() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
    }
    double restart() {
        const double elapsed = ms();
        start_ = std::chrono::steady_clock::now();
        return elapsed;
    }

private:
    std::chrono::steady_clock::time_point start_;
};

/// Processor time of the calling thread, in milliseconds, since construction: what it computed, not what it waited for.
class ThreadStopwatch {
public:
    ThreadStopwatch() : start_(now()) {}
    double ms() const { return now() - start_; }

private:
    static double now() {
        timespec time{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
    }
    double start_;
};

} // namespace trilume
