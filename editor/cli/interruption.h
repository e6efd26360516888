#pragma once

#include <atomic>

namespace trilume::cli {

/// While it lives, SIGINT and SIGTERM set a flag rather than end the process; a second one ends it at once.
class Interruption {
public:
    Interruption();
    ~Interruption();
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;

    static const std::atomic<bool>& flag();
};

} // namespace trilume::cli
