#pragma once

#include "core/clock.h"

#include <string>

namespace trilume::cli {

enum class ProgressMode { Auto, On, Off };

/// A bar on standard error with the time left, for `count` output frames. While it lives, log messages are written
/// above it. Auto shows it on a terminal only.
class Progress {
public:
    Progress(ProgressMode mode, size_t count);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `done` of output frame `index`, 0..1. Draws at most ten times a second.
    void update(size_t index, double done);

private:
    void erase() const;

    bool shown_;
    size_t count_;
    Stopwatch sinceStart_;
    double drawnAt_ = -1e9;
};

/// "1:05:09", "4:30" or "12 s".
std::string durationText(double seconds);

/// What the bar shows: `width` characters at most.
std::string progressLine(double fraction, double secondsLeft, size_t index, size_t count, size_t width);

} // namespace trilume::cli
