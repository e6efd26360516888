#include "core/log.h"

#include "core/text.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <cstdlib>
#include <mutex>
#include <set>

namespace trilume::log {
namespace {

spdlog::level::level_enum spdlogLevel(Level level) {
    switch (level) {
    case Level::Debug:
        return spdlog::level::debug;
    case Level::Info:
        return spdlog::level::info;
    case Level::Warning:
        return spdlog::level::warn;
    case Level::Error:
        return spdlog::level::err;
    }
    return spdlog::level::err;
}

Level ownLevel(spdlog::level::level_enum level) {
    if (level >= spdlog::level::err) return Level::Error;
    if (level == spdlog::level::warn) return Level::Warning;
    return level == spdlog::level::info ? Level::Info : Level::Debug;
}

Level levelFromEnvironment() {
    const char* text = std::getenv("TRILUME_LOG");
    const std::string_view word = text ? text : "";
    if (word == "debug") return Level::Debug;
    if (word == "info") return Level::Info;
    if (word == "error") return Level::Error;
    return Level::Warning;
}

class FunctionSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
public:
    explicit FunctionSink(Sink sink) : sink_(std::move(sink)) {}

private:
    void sink_it_(const spdlog::details::log_msg& message) override {
        sink_(ownLevel(message.level), {message.payload.data(), message.payload.size()});
    }
    void flush_() override {}

    Sink sink_;
};

/// One logger whose only sink locks and forwards, so that the end point can be swapped while others write.
struct Output {
    std::shared_ptr<spdlog::sinks::dist_sink_mt> sink = std::make_shared<spdlog::sinks::dist_sink_mt>();
    spdlog::logger logger{"trilume", sink};
    std::mutex seenMutex;
    std::set<std::string, std::less<>> seen;

    Output() {
        useStandardError();
        logger.set_level(spdlogLevel(levelFromEnvironment()));
    }
    void useStandardError() {
        auto console = std::make_shared<spdlog::sinks::stderr_sink_st>();
        console->set_pattern("trilume: %l: %v");
        sink->set_sinks({console});
    }
};

/// Never destroyed: threads and static destructors may log until the very end.
Output& output() {
    static auto* instance = new Output;
    return *instance;
}

} // namespace

const char* levelName(Level level) {
    switch (level) {
    case Level::Debug:
        return "debug";
    case Level::Info:
        return "info";
    case Level::Warning:
        return "warning";
    case Level::Error:
        return "error";
    }
    return "error";
}

void setSink(Sink sink) {
    if (sink)
        output().sink->set_sinks({std::make_shared<FunctionSink>(std::move(sink))});
    else
        output().useStandardError();
}

void setLevel(Level level) { output().logger.set_level(spdlogLevel(level)); }

void write(Level level, std::string_view message) {
    spdlog::logger& logger = output().logger;
    if (!logger.should_log(spdlogLevel(level))) return;
    const std::string line = oneLine(message);
    logger.log(spdlogLevel(level), spdlog::string_view_t(line.data(), line.size()));
}

void writeOnce(Level level, std::string_view key, std::string_view message) {
    {
        const std::scoped_lock lock(output().seenMutex);
        if (!output().seen.emplace(key).second) return;
    }
    write(level, message);
}

} // namespace trilume::log
