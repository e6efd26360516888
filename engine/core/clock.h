#pragma once

#include <chrono>

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

} // namespace trilume
