#pragma once

#include <fmt/core.h>

#include <functional>
#include <string>
#include <string_view>

namespace trilume::log {

enum class Level { Debug, Info, Warning, Error };
const char* levelName(Level level); ///< "debug", "info", "warning", "error"

/// Receives each message, one line without a newline. Called under a lock, from any thread.
using Sink = std::function<void(Level, std::string_view)>;

/// Replaces the default sink (standard error: `trilume: warning: ...`). An empty sink restores it.
void setSink(Sink sink);
/// Messages below `level` are dropped; default Warning, or what TRILUME_LOG (debug|info|warning|error) says.
void setLevel(Level level);
void write(Level level, std::string_view message);
/// Writes `message` the first time that `key` is seen in this process: what is not supported is named once.
void writeOnce(Level level, std::string_view key, std::string_view message);

template<class... Args>
void debug(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::Debug, fmt::format(format, std::forward<Args>(args)...));
}
template<class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::Info, fmt::format(format, std::forward<Args>(args)...));
}
template<class... Args>
void warning(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::Warning, fmt::format(format, std::forward<Args>(args)...));
}

} // namespace trilume::log
